# Writes to OUT a digest of the files in HEADERS: what was measured with these kernels holds for them alone.
set(digests "")
foreach(header IN LISTS HEADERS)
  file(SHA256 ${header} digest)
  string(APPEND digests "${digest}\n")
endforeach()
string(SHA256 fingerprint "${digests}")
string(SUBSTRING ${fingerprint} 0 16 fingerprint)
file(WRITE ${OUT} "#pragma once\ninline constexpr char kKernelFingerprint[] = \"${fingerprint}\";\n")
