// The light that probes see, averaged over lobes and over all directions (Karis 2013; McAllister et
// al. 2002). Beneath the radiance itself there are levels, in one image below each other; each has
// the maps of all probes beside each other, without borders
// (Rust: gi::probes::light_field::prefiltered).
#ifndef LUMIVOX_LIGHT_FIELD_PREFILTERED
#define LUMIVOX_LIGHT_FIELD_PREFILTERED

// The roughest lobe that light is averaged over; the level before has half of that.
const float ROUGHEST = 0.35;
const uint HALF_ROUGH = 1u, ROUGH = 2u, ALL_SIDES = 3u;   // levels; 0 is the radiance
const int ALL_SIDES_TEXELS = 8;

// Edge of a map [texels].
int edge_of_level(uint level, int edge) {
    return level == ALL_SIDES ? ALL_SIDES_TEXELS : edge >> int(level);
}

// The first texel of a probe's map.
ivec2 map_in_level(uint probe, uint level, uint columns, uint rows, int edge) {
    int above = 0;
    for (uint i = 1u; i < level; ++i) above += int(rows) * edge_of_level(i, edge);
    ivec2 map = ivec2(probe % columns, probe / columns);
    return ivec2(0, above) + map * edge_of_level(level, edge);
}

#endif
