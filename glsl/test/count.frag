// Counts fragments by image atomics; writes no attachment.
#version 460
layout(set = 1, binding = 0, r32ui) uniform restrict uimage3D counts;

void main() {
    imageAtomicAdd(counts, ivec3(gl_FragCoord.xy, gl_PrimitiveID), 1u);
}
