// Dynamic geometry: the blocks of 4×4×4 voxels that it touches.
//
// In a touched block all voxels, static ones too, have their records behind those of the static
// geometry: occupancy becomes that of both, and the block's base the place of its first record
// there. What both were before is kept, so that it can be put back.
#ifndef LUMIVOX_TOUCHED
#define LUMIVOX_TOUCHED

struct TouchedBlock {
    uint block;
    uint static_base;
    uint static_low;          // occupancy by static geometry
    uint static_high;
};

// What one update of dynamic geometry counts; the first three words are those that voxel.fragments
// counts into.
struct TouchedCounters {
    uint fragment_count;      // static ones too
    uint indexed;             // 1 where all of them fit, so that they are listed
    uint unfinished_count;
    uint touched_count;       // blocks
    uint slot_count;          // voxels in them
    uint added_voxels;        // of these, the ones that static geometry does not occupy
    uint dynamic_voxels;      // of these, the ones that dynamic geometry touches
};

#endif
