// How surfaces look probes up (Rust: gi::probes::passes::LookupRow).
#ifndef LUMIVOX_PROBES_LOOKUP_ROW
#define LUMIVOX_PROBES_LOOKUP_ROW

struct LookupRow {
    vec4 first;            // xyz: place of the first probe before it is moved [m]
    vec4 spacing;          // xyz: between probes [m]; w: the smallest of the three
    // xyz: probes along each axis; w: a bit for each side beyond which there are more: −x, +x, −y,
    // and so on
    uvec4 counts;
    uint columns;          // maps beside each other in the images
    float normal_bias_m;   // how far off its surface a place looks probes up
    float weight_floor;
    float crush;
};

#endif
