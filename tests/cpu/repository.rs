//! What holds without a GPU: SPIR-V is fresh and valid, declarations and layouts match it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::passes::{all_passes, all_structs};
use crate::support::sha256::sha256;
use crate::support::{Missing, skipped};
use lumivox::graph::{Access, BindingKind, Pass, SCENE_CONSTANTS, Sets, Shaders};
use lumivox::shader::{self, Field};
use spirq::ReflectConfig;
use spirq::ty::{AccessType, DescriptorType, StructMember, StructType, Type};
use spirq::var::Variable;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All files below a folder, sorted.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path))
        } else {
            found.push(path)
        }
    }
    found.sort();
    found
}

#[test]
fn lines_have_at_most_100_columns() {
    let kinds = ["rs", "glsl", "comp", "vert", "geom", "frag"];
    let folders = ["src", "glsl", "tests", "fuzz/src", "fuzz/targets"];
    let sources = folders
        .iter()
        .flat_map(|folder| files(&root().join(folder)))
        .filter(|path| {
            path.extension()
                .is_some_and(|kind| kinds.iter().any(|k| kind == *k))
        });
    for path in sources {
        let text = std::fs::read_to_string(&path).unwrap();
        for (number, line) in (1..).zip(text.lines()) {
            let columns = line.chars().count();
            assert!(
                columns <= 100,
                "{}:{number}: {columns} columns",
                path.display()
            );
        }
    }
}

/// Where values may be written as Rust prints them, and why.
const DEBUG_TEXT: [(&str, &str); 4] = [
    ("src/measure/chart/point.rs", "keys of records"),
    ("src/measure/stress/record.rs", "keys of records"),
    ("src/reference/cache.rs", "names of files in the cache"),
    ("src/scene/hash.rs", "what a scene's hash is of"),
];

/// What a user reads is in words: no `Vec3(0.0, 1.0, 0.0)` and no `Some("x")`. Numbers, vectors and
/// quoted text are written by `text`.
#[test]
fn messages_have_no_debug_text() {
    let folders = [
        "cli",
        "view",
        "measure",
        "scene",
        "image",
        "reference",
        "metrics",
    ];
    let mut found: BTreeSet<String> = BTreeSet::new();
    for path in folders
        .iter()
        .flat_map(|folder| files(&root().join("src").join(folder)))
        .filter(|path| path.extension().is_some_and(|kind| kind == "rs"))
    {
        let code = std::fs::read_to_string(&path).unwrap();
        let name = path.strip_prefix(root()).unwrap().display().to_string();
        let code = code.split("#[cfg(test)]").next().unwrap();
        for (number, line) in (1..).zip(code.lines()) {
            if line.contains(":?}") || line.contains(":#?}") {
                let may = DEBUG_TEXT.iter().any(|(file, _)| *file == name);
                assert!(may, "{name}:{number}: {}", line.trim());
                found.insert(name.clone());
            }
        }
    }
    for (file, why) in DEBUG_TEXT {
        assert!(found.contains(file), "{file} needs no leave ({why})");
    }
}

/// Where shared code may have words of one family, and why. A path that ends in / is a folder.
const FAMILY_WORDS: [(&str, &str, &str); 10] = [
    ("src/gi/mod.rs", "pub mod voxel_cones", "names the families"),
    ("src/gi/registry.rs", "", "names the techniques"),
    (
        "src/gi/inspect.rs",
        "voxels\";",
        "counts of reports, which older files have",
    ),
    ("src/cli/voxelize.rs", "", "is about voxels"),
    (
        "src/cli/lpv.rs",
        "",
        "is about light propagation volumes, in octrees too",
    ),
    ("src/cli/mod.rs", "voxelize", "names that command"),
    (
        "src/cli/render.rs",
        "alias = \"voxel",
        "options of older command lines",
    ),
    (
        "src/measure/stress/",
        "",
        "scenes in which voxels and cones fail",
    ),
    (
        "src/measure/chart/default.toml",
        "",
        "a grid of the techniques that there are",
    ),
    (
        "src/measure/",
        "walk {} voxels",
        "a column of reports, which older files have",
    ),
];

/// Fields of reports, which older files have.
const REPORT_FIELDS: [&str; 4] = [
    "voxel_size_m",
    "voxels_per_frame",
    "dynamic_voxels",
    "bytes_per_occupied_voxel",
];

/// The seam, the frame and the tools do not mention voxels and cones, except where they have to.
/// Every listed exception is needed.
#[test]
fn shared_code_has_no_words_of_a_family() {
    let words = ["voxel", "cone", "brick", "octree", "clipmap"];
    let seam = [
        "mod",
        "entry",
        "inspect",
        "registry",
        "settings",
        "simulator",
    ];
    let mut paths: Vec<PathBuf> = seam
        .iter()
        .map(|file| root().join(format!("src/gi/{file}.rs")))
        .collect();
    for folder in ["frame", "render", "view", "cli", "measure"] {
        paths.extend(files(&root().join("src").join(folder)));
    }
    let mut used = BTreeSet::new();
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        let name = path.strip_prefix(root()).unwrap().display().to_string();
        for (number, line) in (1..).zip(code.lines()) {
            let mut rest = line.to_lowercase();
            for field in REPORT_FIELDS {
                rest = rest.replace(field, "");
            }
            if !words.iter().any(|word| rest.contains(word)) {
                continue;
            }
            let exception = FAMILY_WORDS.iter().position(|(place, words, _)| {
                let is_there = name == *place || (place.ends_with('/') && name.starts_with(place));
                is_there && line.contains(words)
            });
            let exception = exception.unwrap_or_else(|| panic!("{name}:{number}: {line}"));
            used.insert(exception);
        }
    }
    assert_eq!(used.len(), FAMILY_WORDS.len(), "an exception is not needed");
}

/// Whether a program is there; where it is not, the test is skipped.
fn installed(tool: &str) -> bool {
    let found = Command::new(tool).arg("--version").output().is_ok();
    if !found {
        skipped(&Missing::Package(tool));
    }
    found
}

/// Stem to source and flags: the entry points in `glsl/`, and the variants.
fn sources() -> BTreeMap<String, (PathBuf, Vec<String>)> {
    let glsl = root().join("glsl");
    let mut sources = BTreeMap::new();
    for path in files(&glsl) {
        if path.extension().is_some_and(|extension| {
            ["comp", "vert", "geom", "frag"]
                .iter()
                .any(|stage| extension == *stage)
        }) {
            sources.insert(
                path.strip_prefix(&glsl)
                    .unwrap()
                    .to_str()
                    .unwrap()
                    .to_owned(),
                (path, Vec::new()),
            );
        }
    }
    for line in std::fs::read_to_string(glsl.join("variants.txt"))
        .unwrap_or_default()
        .lines()
    {
        let words: Vec<&str> = line.split('#').next().unwrap().split_whitespace().collect();
        if let [source, defines, stem] = words[..] {
            sources.insert(
                stem.to_owned(),
                (
                    glsl.join(source),
                    defines
                        .split(',')
                        .map(|define| format!("-D{define}"))
                        .collect(),
                ),
            );
        }
    }
    sources
}

/// Everything that a file includes, transitively.
fn includes(path: &Path, found: &mut BTreeSet<PathBuf>) {
    for line in std::fs::read_to_string(path).unwrap().lines() {
        let Some(rest) = line
            .trim_start()
            .strip_prefix('#')
            .and_then(|rest| rest.trim_start().strip_prefix("include"))
        else {
            continue;
        };
        let name = rest.split('"').nth(1).unwrap();
        let candidates = [
            path.parent().unwrap().join(name),
            root().join("glsl").join(name),
        ];
        let included = candidates
            .iter()
            .find(|candidate| candidate.is_file())
            .unwrap()
            .canonicalize()
            .unwrap();
        if found.insert(included.clone()) {
            includes(&included, found);
        }
    }
}

/// The hash that `tools/shaders` writes.
fn digest(source: &Path, defines: &[String]) -> String {
    let base = root().canonicalize().unwrap();
    let mut included = BTreeSet::new();
    includes(source, &mut included);
    let flags = ["-V", "--target-env", "vulkan1.2"]
        .into_iter()
        .chain(defines.iter().map(String::as_str));
    let mut bytes = flags.collect::<Vec<_>>().join(" ").into_bytes();
    for path in std::iter::once(source.canonicalize().unwrap()).chain(included) {
        let name = path.strip_prefix(&base).unwrap().to_str().unwrap();
        bytes.extend(
            [
                b"\0",
                name.as_bytes(),
                b"\0",
                &std::fs::read(&path).unwrap(),
            ]
            .concat(),
        );
    }
    sha256(&bytes)
}

#[test]
fn sha256_knows_its_published_answers() {
    assert_eq!(
        sha256(b""),
        "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    );
    assert_eq!(
        sha256(b"abc"),
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    );
}

#[test]
fn spirv_is_fresh() {
    let manifest = std::fs::read_to_string(root().join("spirv/MANIFEST")).unwrap();
    let listed: BTreeMap<&str, &str> = manifest
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split_once(' ').unwrap())
        .map(|(hash, stem)| (stem, hash))
        .collect();
    let wanted: BTreeMap<String, String> = sources()
        .into_iter()
        .map(|(stem, (source, defines))| (stem, digest(&source, &defines)))
        .collect();
    for (stem, hash) in &wanted {
        assert_eq!(
            listed.get(stem.as_str()),
            Some(&hash.as_str()),
            "{stem} is out of date: run tools/shaders"
        );
    }
    assert_eq!(
        listed.len(),
        wanted.len(),
        "the manifest lists modules without source: run tools/shaders"
    );
    assert!(
        shader::stems().eq(wanted.keys().map(String::as_str)),
        "the embedded modules are not those of glsl/: run tools/shaders"
    );
}

#[test]
fn spirv_is_what_the_compiler_makes_where_there_is_one() {
    if installed("glslangValidator") && installed("python3") {
        let output = Command::new(root().join("tools/shaders"))
            .arg("--check")
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}

#[test]
fn spirv_is_valid_where_there_is_a_validator() {
    if !installed("spirv-val") {
        return;
    }
    for stem in shader::stems() {
        let output = Command::new("spirv-val")
            .args(["--target-env", "vulkan1.3"])
            .arg(root().join(format!("spirv/{stem}.spv")))
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{stem}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}

#[test]
fn naga_accepts_exactly_the_listed_modules() {
    let accepts = |stem: &&str| {
        let bytes: Vec<u8> = shader::words(stem)
            .unwrap()
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .collect();
        let options = naga::front::spv::Options {
            adjust_coordinate_space: false,
            ..Default::default()
        };
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::all(),
        );
        naga::front::spv::parse_u8_slice(&bytes, &options)
            .is_ok_and(|module| validator.validate(&module).is_ok())
    };
    let accepted: Vec<&str> = shader::stems().filter(accepts).collect();
    let list = std::fs::read_to_string(root().join("tests/naga_accepts.txt")).unwrap();
    let listed: Vec<&str> = list.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(
        accepted, listed,
        "tests/naga_accepts.txt has to list what is on the left"
    );
}

/// The variables that a module declares, or only those that spirq sees in use; it overlooks image
/// atomics.
fn variables(stem: &str, all: bool) -> Vec<Variable> {
    let mut entries = ReflectConfig::new()
        .spv(shader::words(stem).unwrap())
        .ref_all_rscs(all)
        .reflect()
        .unwrap();
    assert_eq!(entries.len(), 1, "{stem}: one entry point");
    entries.remove(0).vars
}

/// What a pass has to declare: all of set 1 and of the push constants, and of the shared sets what
/// is in use.
fn checked_variables(stem: &str) -> Vec<Variable> {
    let is_shared = |variable: &Variable| match variable {
        Variable::Descriptor { desc_bind, .. } => desc_bind.set() != 1,
        _ => false,
    };
    let own = variables(stem, true)
        .into_iter()
        .filter(|variable| !is_shared(variable));
    own.chain(variables(stem, false).into_iter().filter(is_shared))
        .collect()
}

/// Checks one pass against its modules, and against those that let the device trace rays where it
/// has such; says what is wrong.
fn check_pass(pass: &Pass) -> Result<(), String> {
    check_variant(pass, false)?;
    if pass.traces() {
        check_variant(pass, true)?;
    }
    Ok(())
}

fn check_variant(pass: &Pass, queries: bool) -> Result<(), String> {
    let mut used: BTreeMap<u32, u32> = BTreeMap::new();
    let mut constants: BTreeSet<(u32, String)> = BTreeSet::new();
    let mut params = None;
    for (_, stem) in pass.modules(queries) {
        for variable in checked_variables(&stem) {
            match &variable {
                Variable::PushConstant { ty, .. } => {
                    let mut found = Vec::new();
                    structs(ty, &mut found);
                    let name = found[0].name().unwrap_or("?").to_owned();
                    let block = (name, members(found[0]));
                    if params.get_or_insert_with(|| block.clone()) != &block {
                        return Err(format!("{stem}: other push constants than {params:?}"));
                    }
                }
                Variable::SpecConstant { name, spec_id, .. } => {
                    // Only the size of a workgroup has no name in a module.
                    let name = name.as_deref().unwrap_or("WORKGROUP");
                    // The graph sets those of the scene.
                    if !SCENE_CONSTANTS.contains(&(*spec_id, name)) {
                        constants.insert((*spec_id, name.to_owned()));
                    }
                }
                Variable::Descriptor {
                    desc_bind,
                    desc_ty,
                    ty,
                    nbind,
                    ..
                } => {
                    let place = format!(
                        "{stem}, set {}, binding {}",
                        desc_bind.set(),
                        desc_bind.bind()
                    );
                    let fits = *nbind == 1
                        && match desc_bind.set() {
                            0 => pass.sets != Sets::None && fits_scene(desc_bind.bind(), desc_ty),
                            1 => {
                                *used.entry(desc_bind.bind()).or_default() |= access_bits(desc_ty);
                                {
                                    let bound = (pass, desc_bind.bind(), queries);
                                    fits_binding(bound, desc_ty, variable.name(), ty)
                                }
                            }
                            2 => {
                                pass.sets == Sets::SceneAndMaterials
                                    && desc_bind.bind() < lumivox::graph::MATERIAL_TEXTURES as u32
                                    && matches!(desc_ty, DescriptorType::SampledImage())
                            }
                            _ => false,
                        };
                    if !fits {
                        return Err(format!(
                            "{place}: {desc_ty:?} {:?} is not as declared",
                            variable.name()
                        ));
                    }
                }
                _ => {}
            }
        }
    }
    let declared = (pass.params).map(|(name, fields)| (name.to_owned(), declared_members(fields)));
    if params != declared || pass.push_bytes() > 128 {
        return Err(format!(
            "push constants {params:?} in the shaders, {declared:?} declared"
        ));
    }
    let declared: BTreeSet<(u32, String)> = (0..)
        .zip(pass.constants)
        .filter(|(_, name)| !name.is_empty())
        .map(|(id, name)| (id, (*name).to_owned()))
        .collect();
    if declared != constants {
        return Err(format!(
            "constants {declared:?} declared, the shaders have {constants:?}"
        ));
    }
    let names: BTreeSet<&str> = pass.bindings.iter().map(|binding| binding.name).collect();
    if names.len() != pass.bindings.len() {
        return Err("two bindings have one name".to_owned());
    }
    for (index, binding) in (0u32..).zip(pass.bindings) {
        let bits = used.get(&index).copied().unwrap_or(0);
        if !fits_access(binding.access, bits)
            || access_is_compute(binding.access) != pass.is_compute()
        {
            return Err(format!(
                "binding {}: {:?} declared, the shaders have {bits:02b} (write, read)",
                binding.name, binding.access
            ));
        }
    }
    Ok(())
}

fn fits_scene(binding: u32, kind: &DescriptorType) -> bool {
    match binding {
        0 => matches!(kind, DescriptorType::UniformBuffer()),
        1..=3 => matches!(kind, DescriptorType::Sampler()),
        4..=10 | 12 => matches!(kind, DescriptorType::StorageBuffer(AccessType::ReadOnly)),
        11 => matches!(kind, DescriptorType::SampledImage()),
        _ => false,
    }
}

fn fits_binding(
    (pass, index, queries): (&Pass, u32, bool),
    kind: &DescriptorType,
    name: Option<&str>,
    ty: &Type,
) -> bool {
    let Some(binding) = pass.bindings.get(index as usize) else {
        return false;
    };
    let kind_fits = match binding.kind {
        BindingKind::Buffer => matches!(kind, DescriptorType::StorageBuffer(_)),
        BindingKind::Image => matches!(kind, DescriptorType::StorageImage(_)),
        BindingKind::Rays if queries => matches!(kind, DescriptorType::AccelStruct()),
        BindingKind::Sampled | BindingKind::Rays => {
            matches!(kind, DescriptorType::SampledImage())
        }
    };
    // A block without an instance name is known by its members.
    let member_fits = matches!(ty,
        Type::Struct(block) if
        block.members.iter().any(|member| member.name.as_deref() == Some(binding.name)));
    kind_fits && (name == Some(binding.name) || member_fits)
}

/// 1 for reading, 2 for writing.
fn access_bits(kind: &DescriptorType) -> u32 {
    match kind {
        DescriptorType::StorageBuffer(access) | DescriptorType::StorageImage(access) => {
            *access as u32
        }
        _ => 1,
    }
}

fn fits_access(access: Access, bits: u32) -> bool {
    match access {
        Access::ComputeRead
        | Access::ComputeSampled
        | Access::RasterRead
        | Access::RasterSampled => bits == 1,
        Access::ComputeWrite => bits == 2,
        Access::ComputeReadWrite => bits == 3,
        Access::RasterReadWrite => bits & 2 != 0,
        _ => false,
    }
}

fn access_is_compute(access: Access) -> bool {
    matches!(
        access,
        Access::ComputeRead
            | Access::ComputeWrite
            | Access::ComputeReadWrite
            | Access::ComputeSampled
    )
}

#[test]
fn every_pass_matches_its_modules() {
    let mut names = BTreeSet::new();
    for pass in all_passes() {
        // Alternatives of one step share its name; they differ in their shaders.
        let stems: Vec<_> = pass.stages().into_iter().map(|(_, stem)| stem).collect();
        assert!(
            names.insert((pass.name, stems)),
            "the pass {} is declared twice",
            pass.name
        );
        check_pass(pass).unwrap_or_else(|error| panic!("pass {}: {error}", pass.name));
    }
    let modules = |pass: &&Pass| {
        let variant = pass.traces().then(|| pass.modules(true));
        let all = pass.modules(false).into_iter();
        all.chain(variant.into_iter().flatten()).collect::<Vec<_>>()
    };
    let declared: BTreeSet<String> = all_passes()
        .iter()
        .flat_map(modules)
        .map(|(_, stem)| stem)
        .collect();
    // What draws a window is no pass; its tests run it under validation.
    let is_of_window = |stem: &str| stem.starts_with("view/");
    let orphans: Vec<&str> = shader::stems()
        .filter(|stem| !declared.contains(*stem) && !is_of_window(stem))
        .collect();
    assert!(
        orphans.is_empty(),
        "no pass uses these modules: {orphans:?}; add passes to `passes` of the technique's Entry"
    );
}

/// A copy of a pass of compute shaders; `None` of another.
fn copy(pass: &Pass) -> Option<Pass> {
    let Shaders::Compute(stem) = pass.shaders else {
        return None;
    };
    let shaders = Shaders::Compute(stem);
    Some(Pass { shaders, ..*pass })
}

/// Whoever gives values by name relies on this: the names of any two neighbours, swapped in any
/// pass, are noticed.
#[test]
fn swapped_names_are_noticed() {
    let (mut constants, mut bindings) = (0, 0);
    for mut pass in all_passes().into_iter().filter_map(copy) {
        let whole = (pass.constants, pass.bindings);
        for second in 1..whole.0.len() {
            if whole.0[second - 1] == whole.0[second] {
                continue;
            }
            let mut names = whole.0.to_vec();
            names.swap(second - 1, second);
            pass.constants = names.leak();
            assert!(check_pass(&pass).is_err(), "{}: {pass:?}", pass.name);
            constants += 1;
        }
        pass.constants = whole.0;
        for second in 1..whole.1.len() {
            let mut changed = whole.1.to_vec();
            changed[second - 1].name = whole.1[second].name;
            changed[second].name = whole.1[second - 1].name;
            pass.bindings = changed.leak();
            assert!(check_pass(&pass).is_err(), "{}: {pass:?}", pass.name);
            bindings += 1;
        }
        pass.bindings = whole.1;
        assert_eq!(check_pass(&pass), Ok(()), "{}", pass.name);
    }
    assert!(
        constants > 100 && bindings > 200,
        "{constants} constants, {bindings} bindings"
    );
}

#[test]
fn a_declaration_that_does_not_match_is_noticed() {
    use crate::support::passes::COPY;
    let change = |change: fn(&mut Pass)| {
        let mut pass = copy(&COPY).unwrap();
        change(&mut pass);
        check_pass(&pass)
    };
    assert_eq!(change(|_| {}), Ok(()));
    assert!(change(|pass| pass.params = None).is_err());
    assert!(change(|pass| pass.params = crate::support::passes::MATERIAL.params).is_err());
    assert!(change(|pass| pass.constants = &["SIDES"]).is_err());
    assert!(change(|pass| pass.bindings = &COPY.bindings[..1]).is_err());
    assert!(change(|pass| pass.bindings = crate::support::passes::SAMPLE.bindings).is_err());
    const READ_WRITE: &[lumivox::graph::Binding] = &[
        COPY_SOURCE,
        lumivox::graph::Binding::buffer("target", Access::ComputeReadWrite),
    ];
    const COPY_SOURCE: lumivox::graph::Binding =
        lumivox::graph::Binding::buffer("source", Access::ComputeRead);
    assert!(change(|pass| pass.bindings = READ_WRITE).is_err());
}

/// All struct types inside a type.
fn structs<'t>(ty: &'t Type, found: &mut Vec<&'t StructType>) {
    match ty {
        Type::Struct(block) => {
            found.push(block);
            block
                .members
                .iter()
                .for_each(|member| structs(&member.ty, found));
        }
        Type::Array(array) => structs(&array.element_ty, found),
        _ => {}
    }
}

/// Name, offset and size of each member.
fn members(block: &StructType) -> Vec<(String, usize, Option<usize>)> {
    let name = |member: &StructMember| member.name.as_deref().unwrap_or("?").to_owned();
    let row = |member| (name(member), member.offset.unwrap(), member.ty.nbyte());
    block.members.iter().map(row).collect()
}

/// The same members as Rust declares them.
fn declared_members(fields: &[Field]) -> Vec<(String, usize, Option<usize>)> {
    let row = |field: &Field| (field.name.to_owned(), field.offset, Some(field.size));
    fields.iter().map(row).collect()
}

#[test]
fn shared_structs_have_one_layout() {
    let rust = all_structs();
    let mut seen = BTreeSet::new();
    for stem in shader::stems() {
        for variable in variables(stem, true) {
            let mut found = Vec::new();
            structs(variable.ty(), &mut found);
            for block in found {
                let Some((name, fields)) =
                    rust.iter().find(|(name, _)| block.name() == Some(*name))
                else {
                    continue;
                };
                seen.insert(*name);
                let (glsl, expected) = (members(block), declared_members(fields));
                assert_eq!(glsl, expected, "{stem}: struct {name}");
            }
        }
    }
    let unused: Vec<_> = rust
        .iter()
        .map(|(name, _)| *name)
        .filter(|name| !seen.contains(name))
        .collect();
    assert!(unused.is_empty(), "no shader has these structs: {unused:?}");
}

/// Comparators keep NaN: tests use functions that drop it only where that is mended.
#[test]
fn comparators_let_no_nan_through() {
    for path in files(&root().join("tests")) {
        if path.extension().is_none_or(|extension| extension != "rs")
            || path.ends_with("compare.rs")
            || path.ends_with("repository.rs")
        {
            continue;
        }
        let code = std::fs::read_to_string(&path).unwrap();
        for unsafe_word in [
            "f64::max)",
            "f32::max)",
            "f64::min)",
            "f32::min)",
            "abs().max_element()",
            ".max_element() /",
        ] {
            assert!(
                !code.contains(unsafe_word),
                "{}: `{unsafe_word}` drops NaN; use support::compare",
                path.display()
            );
        }
    }
}

#[derive(serde::Deserialize)]
struct Mutations {
    mutation: Vec<Mutation>,
}

#[derive(serde::Deserialize)]
struct Mutation {
    name: String,
    file: String,
    old: String,
    new: String,
    test: String,
    filters: Vec<String>,
    survives: Option<String>,
}

/// `tools/mutants` can make every change of its list, and every one names tests.
#[test]
fn mutations_fit_the_tree() {
    let text = std::fs::read_to_string(root().join("tools/mutations.toml")).unwrap();
    let mutations = toml::from_str::<Mutations>(&text).unwrap().mutation;
    assert!(mutations.len() >= 60, "{} mutations", mutations.len());
    let names: BTreeSet<&str> = mutations
        .iter()
        .map(|mutation| mutation.name.as_str())
        .collect();
    assert_eq!(names.len(), mutations.len(), "two mutations have one name");
    for Mutation {
        name,
        file,
        old,
        new,
        test,
        filters,
        survives,
    } in &mutations
    {
        let code = std::fs::read_to_string(root().join(file))
            .unwrap_or_else(|error| panic!("{name}: {file}: {error}"));
        assert_eq!(
            code.matches(old.as_str()).count(),
            1,
            "{name}: what it changes has to stand once in {file}"
        );
        assert_ne!(old, new, "{name} changes nothing");
        assert!(
            ["lib", "cpu", "gpu", "program"].contains(&test.as_str()) && !filters.is_empty(),
            "{name}: no tests"
        );
        assert!(
            survives.as_ref().is_none_or(|reason| reason.len() > 20),
            "{name}: survives without a reason"
        );
    }
}
