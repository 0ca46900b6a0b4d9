// Which probes a pass is about (Rust: gi::probes::list). The including pass declares LIST_BINDING.
#ifndef LUMIVOX_PROBES_LIST
#define LUMIVOX_PROBES_LIST

layout(std430, set = 1, binding = LIST_BINDING) restrict readonly buffer ProbeList {
    uvec2 probe_list[];   // x: number; y: seed of the turn of its rays
};

#endif
