// The light that probes see, averaged over lobes and over all directions (Karis 2013; McAllister et
// al. 2002). Beneath the radiance itself there are levels, in one image: the first, and below it
// the others beside each other. Each has the maps of all probes beside each other, without borders
// (Rust: gi::probes::prefiltered).
#ifndef LUMIVOX_PROBES_PREFILTERED
#define LUMIVOX_PROBES_PREFILTERED

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
    ivec2 first = ivec2(0);
    if (level != HALF_ROUGH) first.y = int(rows) * edge_of_level(HALF_ROUGH, edge);
    if (level == ALL_SIDES) first.x = int(columns) * edge_of_level(ROUGH, edge);
    return first + ivec2(probe % columns, probe / columns) * edge_of_level(level, edge);
}

#endif
