#pragma once

#include "render/camera.h"

namespace vdb_diffuse {

/// Views from all sides: the camera of `view` goes once around a vertical axis in `frames` equal steps, the
/// first being where it stands. The axis passes through `look_at`, or else the middle of the volume; height,
/// distance and angle of view stay, and are chosen, where they are not given, so that the volume is in view
/// from every side. \throws UsageError as Camera
std::vector<CameraSettings> turntable(const CameraSettings& view, const std::vector<Vec3d>& outline,
                                      int frames);

}  // namespace vdb_diffuse
