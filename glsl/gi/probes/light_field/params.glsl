// What passes are told that gather by rays through a light field (Rust:
// gi::probes::light_field::passes::FieldGatherParams).
#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform FieldGatherParams {
    LookupRow lookup;
    uint ray_count;      // of all dispatches
    uint first_ray;      // of this dispatch, which adds to what those before it left
    uint end_ray;
    uint pattern;        // of a tile of pixels, each of which has directions of its own
    float origin_bias;   // how far off its surface a ray starts [texels of the nearest probe]
    float thickness_m;   // the greatest thickness of surfaces
} params;
