// How cones are marched through a volume: part of the parameters of every pass that does.
struct MarchSettings {
    float resolution;        // voxels along an edge of the grid
    float step_factor;       // β: step in sample diameters
    // g: 1 is the textbook; above it makes up for what trilinear sampling lets through
    float opacity_exponent;
    // k: a sample's diameter is at most its height over the receiver's tangent plane / k; 0: off
    float height_clamp;
    float max_distance;      // [voxels]
    float voxel_size_m;
    float ao_falloff;        // λ of the ambient visibility's 1 / (1 + λ r) [1/m]
    // of the cones' origin along the geometric normal [texels read there]
    float start_offset;
    float early_stop;        // a cone ends where less than this passes through
    float first_hit;         // a sample of more opacity than this fills its cone; 1: none
    // s of opacity's factor smoothstep(0, 1, s √(t/D)) at a distance t of the longest, D; 0: 1
    float near_strength;
    float radius_falloff;    // λ of the cone's radius in place of its distance [1/m]
};
