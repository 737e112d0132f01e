// gnuplot as a function: from a script to a picture, without a file in between.
#pragma once

#include <string>

namespace palpate {

struct Picture {
  std::string bytes;     ///< empty where it failed
  std::string error;     ///< one line
  bool missing = false;  ///< there is no gnuplot on this machine
};

/// Runs gnuplot without the user's settings; `script` writes its picture to standard output.
Picture run_gnuplot(const std::string& script);

/// Text in single quotes, as gnuplot's strings without enhanced mode want it.
std::string gnuplot_quoted(const std::string& text);

}  // namespace palpate
