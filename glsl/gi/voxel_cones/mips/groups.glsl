// Lists of groups of 4³ texels, one for each mip but the finest: workgroups along x, y and z (a
// cube each), number of groups, and these.
#ifndef LUMIVOX_GROUPS
#define LUMIVOX_GROUPS

const uint GROUP_HEAD = 4u;
const uint GROUPS_ALONG = 32768u;   // workgroups along x: fewer than any device has

// Groups along an edge of a mip.
int group_row(int size) {
    return (size + 3) / 4;
}

ivec3 group_at(int index, int along) {
    return ivec3(index % along, index / along % along, index / (along * along));
}

#endif
