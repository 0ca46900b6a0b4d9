// Whether the environment is a map. Passes do not declare this constant: the graph sets it from the
// scene of the frame (Rust: graph::SCENE_CONSTANTS).
#ifndef LUMIVOX_SKY
#define LUMIVOX_SKY

layout(constant_id = 64) const bool SKY = true;

#endif
