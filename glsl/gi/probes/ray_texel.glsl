// Where the rays of probes are kept (Rust: gi::probes::rays).
#ifndef LUMIVOX_PROBES_RAY_TEXEL
#define LUMIVOX_PROBES_RAY_TEXEL

// Rays are the texels of an image, all of a probe before those of the next.
const uint RAYS_A_ROW = 4096u;

ivec2 texel_of_ray(uint ray) {
    return ivec2(ray % RAYS_A_ROW, ray / RAYS_A_ROW);
}

#endif
