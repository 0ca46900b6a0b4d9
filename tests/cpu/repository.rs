//! What holds without a GPU: SPIR-V is fresh and valid, declarations and layouts match it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::passes::{all_passes, all_structs};
use crate::support::sha256::sha256;
use crate::support::{Missing, skipped};
use lumivox::graph::{Access, BindingKind, Pass, Sets};
use lumivox::shader;
use spirq::ReflectConfig;
use spirq::ty::{AccessType, DescriptorType, Type};
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

/// Checks one pass against its modules; says what is wrong.
fn check_pass(pass: &Pass) -> Result<(), String> {
    let mut used: BTreeMap<u32, u32> = BTreeMap::new();
    let mut push = 0;
    for (_, stem) in pass.stages() {
        for variable in checked_variables(stem) {
            match &variable {
                Variable::PushConstant { ty, .. } => push = push.max(ty.nbyte().unwrap()),
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
                                fits_binding(pass, desc_bind.bind(), desc_ty, variable.name(), ty)
                            }
                            2 => {
                                pass.sets == Sets::SceneAndMaterials
                                    && desc_bind.bind() < 4
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
    if push != pass.push_bytes as usize || push > 128 {
        return Err(format!(
            "{push} bytes of push constants in the shaders, {} declared",
            pass.push_bytes
        ));
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
        4..=7 => matches!(kind, DescriptorType::StorageBuffer(AccessType::ReadOnly)),
        _ => false,
    }
}

fn fits_binding(
    pass: &Pass,
    index: u32,
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
        BindingKind::Sampled => matches!(kind, DescriptorType::SampledImage()),
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
    let declared: BTreeSet<&str> = all_passes()
        .iter()
        .flat_map(|pass| pass.stages())
        .map(|(_, stem)| stem)
        .collect();
    let orphans: Vec<&str> = shader::stems()
        .filter(|stem| !declared.contains(stem))
        .collect();
    assert!(
        orphans.is_empty(),
        "modules without a pass in tests/support/passes.rs: {orphans:?}"
    );
}

#[test]
fn a_declaration_that_does_not_match_is_noticed() {
    use crate::support::passes::COPY;
    let change = |change: fn(&mut Pass)| {
        let mut pass = Pass {
            name: COPY.name,
            shaders: lumivox::graph::Shaders::Compute("test/copy.comp"),
            ..COPY
        };
        change(&mut pass);
        check_pass(&pass)
    };
    assert_eq!(change(|_| {}), Ok(()));
    assert!(change(|pass| pass.push_bytes = 8).is_err());
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
fn structs<'t>(ty: &'t Type, found: &mut Vec<&'t spirq::ty::StructType>) {
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
                let glsl: Vec<_> = block
                    .members
                    .iter()
                    .map(|member| {
                        (
                            member.name.as_deref().unwrap_or("?"),
                            member.offset.unwrap(),
                            member.ty.nbyte(),
                        )
                    })
                    .collect();
                let expected: Vec<_> = fields
                    .iter()
                    .map(|field| (field.name, field.offset, Some(field.size)))
                    .collect();
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

/// Comparators keep NaN: what drops it is used nowhere in tests but where it is mended.
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
