// A window of voxels that moves over the scene.
#ifndef LUMIVOX_WINDOW
#define LUMIVOX_WINDOW

// The block's records are not moved but made anew.
const uint NEW_BLOCK = 0xffffffffu;

#endif
