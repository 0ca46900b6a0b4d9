// Where rays of a pixel start. The including pass binds the frame.
#ifndef LUMIVOX_BVH_START
#define LUMIVOX_BVH_START

// The rounding of positions from the depth buffer, as a share of coordinates and distances, and
// room (Rust: render::bvh::START_SHARE).
const float START_SHARE = 2e-5;

// How far off a place on the depth buffer its rays start [m].
float start_distance(vec3 position) {
    vec3 largest = max(abs(position), abs(frame.eye_ws.xyz - position));
    return START_SHARE * max(largest.x, max(largest.y, largest.z));
}

#endif
