// What passes of paths bind, and the constants they have, besides those of
// render/bvh/bindings.glsl.
#ifndef LUMIVOX_PATHS_BINDINGS
#define LUMIVOX_PATHS_BINDINGS

#include "shared/light_view.glsl"

layout(constant_id = 3) const uint EMITTERS = 0;       // rows of the table; 0: nothing emits
layout(constant_id = 4) const uint SHADOW_MAPS = 0;    // 1: maps say what hides a light at a hit
layout(constant_id = 5) const uint BUMPS = 0;          // 1: some materials have normal maps

// A row of the table from which an emissive triangle is drawn.
struct GpuEmitter {
    float own_share;   // of the row's draws
    uint own;
    uint other;
};

layout(std430, set = 1, binding = 5) restrict readonly buffer Emitters { GpuEmitter emitters[]; };
// of each material: density of drawn points [1/m²]
layout(std430, set = 1, binding = 6) restrict readonly buffer EmitterDensities {
    float emitter_densities[];
};
layout(std430, set = 1, binding = 7) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(set = 1, binding = 8) uniform texture2DArray shadow_maps;

#endif
