// Irradiance and ambient visibility of each surface, and how many see no probe. The including pass
// declares view_depth, normals, indirect_diffuse, probe_orphans, and how probes are looked up.
#ifndef LUMIVOX_PROBES_GATHER
#define LUMIVOX_PROBES_GATHER

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    bool is_there = read_receiver(texel, surface), is_orphan = false;
    vec4 light = vec4(0.0);
    if (is_there)
        light = light_of_probes(
            surface.position_ws, surface.geometric_normal, surface.shading_normal, is_orphan);
    if (is_orphan) atomicAdd(probe_orphans, 1u);
    imageStore(indirect_diffuse, texel, light);
}

#endif
