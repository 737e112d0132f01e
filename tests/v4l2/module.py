"""A camera by the Python module, inside the guest: its frames, and what is raised once it is unplugged."""

import pathlib
import time

import numpy as np
import palpate as pp

(camera,) = pp.cameras()
assert (camera.driver, camera.trouble) == ("vivid", ""), camera

source = camera.source + "?format=GREY&size=320x180&control.osd_text_mode=2"
lost = None
opened_s = time.monotonic()
with pp.open(source, sensor="pad.json", outputs="force", keep="image", patience_s=1) as stream:
    assert stream.live and (stream.width, stream.height) == (320, 180)
    assert dict(stream.details), "settings of the camera as it uses them"
    touches = [next(stream) for _ in range(3)]
    sequences = [t.sequence for t in touches]
    assert sequences == sorted(set(sequences)) and sequences[-1] >= 2 and stream.dropped >= 0
    assert all(abs(t.area_px - 320 * 180 * 7 // 8) < 600 for t in touches), [t.area_px for t in touches]
    assert touches[0].image.shape == (180, 320) and np.array_equal(touches[0].image, touches[2].image)
    # The driver computes its stamps ahead of time.
    assert np.isnan(touches[2].monotonic_s) or opened_s - 60 < touches[2].monotonic_s < time.monotonic() + 60
    pathlib.Path("/sys/bus/platform/drivers/vivid/unbind").write_text("vivid.0")
    start_s = time.monotonic()
    try:
        for _ in stream:
            pass
    except pp.DeviceError as error:
        lost = error
assert lost is not None and camera.source.removeprefix("camera:") in str(lost), lost
assert "unplugged" in lost.found and lost.remedy
assert time.monotonic() - start_s >= 1
print(f"lost: {lost}")
assert touches[1].area_px and touches[1].image.max() > 100  # what was read stays

assert pp.cameras() == []
try:
    pp.open(source)
except pp.DeviceError as error:
    print(f"gone: {error}")
    assert "no such device node" in error.found and "plugging" in error.remedy
else:
    raise AssertionError("a camera that is gone was opened")
