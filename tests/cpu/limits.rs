//! What passes need of a device.

use crate::support::passes::all_passes;
use lumivox::graph::pass::{BindingKind, Shaders};
use lumivox::shader;
use lumivox::vulkan::NEEDED;

/// Storage buffers and sampled images of the sets that all passes share: seven of a scene, and a
/// sky with the five textures of a material.
const SHARED: [usize; 2] = [7, 6];

/// The workgroup of a module, from its execution modes; of a size that the host chooses, nothing.
fn workgroup(words: &[u32]) -> usize {
    const EXECUTION_MODE: u32 = 16;
    const LOCAL_SIZE: u32 = 17;
    let mut rest = &words[5..];
    while let [first, ..] = rest {
        let (length, opcode) = ((first >> 16) as usize, first & 0xffff);
        if let (EXECUTION_MODE, [_, _, LOCAL_SIZE, sizes @ ..]) = (opcode, &rest[..length]) {
            return sizes.iter().map(|size| *size as usize).product();
        }
        rest = &rest[length..];
    }
    0
}

#[test]
fn needed_limits_are_what_passes_have() {
    let mut most = [0; 5];
    for pass in all_passes() {
        let count = |kinds: &[BindingKind]| {
            let bindings = pass.bindings.iter();
            bindings
                .filter(|binding| kinds.contains(&binding.kind))
                .count()
        };
        let [targets, threads] = match &pass.shaders {
            Shaders::Compute(stem) => [0, workgroup(&shader::words(stem).unwrap())],
            Shaders::Raster { state, .. } => [state.color.len(), 0],
        };
        // Of these every device has 128.
        assert!(pass.push_bytes() <= 128, "{}", pass.name);
        let own = [
            SHARED[0] + count(&[BindingKind::Buffer]),
            count(&[BindingKind::Image]),
            SHARED[1] + count(&[BindingKind::Sampled, BindingKind::Rays]),
            targets,
            threads,
        ];
        for (most, own) in most.iter_mut().zip(own) {
            *most = own.max(*most);
        }
    }
    let needed = NEEDED.map(|needed| (needed.name, needed.least as usize));
    let found: Vec<_> = needed.iter().map(|(name, _)| *name).zip(most).collect();
    assert_eq!(found, needed);
}
