// Motion through a camera: simulated pictures of a moved object, measured by the pipeline and followed.
#pragma once

namespace palpate::perf {

/// Prints a row for each object and path: errors, intervals, what is undetermined, losses. `seconds`: of each
/// path; `only`: of the runs whose name begins so, null: of all.
void follow_through_camera(double seconds, const char* only);

}  // namespace palpate::perf
