//! Modules keep their layers: which file uses which, by `crate::`, `super::` and child paths
//! through re-exports, and which shader includes which.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A module: its names from the root of the crate on.
type Module = Vec<String>;

/// The layers, the lowest first; `image` is below all, `output` and `text` below `image`.
const LAYERS: &[&str] = &[
    "vulkan", "shader", "graph", "scene", "render", "gi", "frame", "measure", "view", "cli",
];

fn may_use(user: &str, used: &str) -> bool {
    let rank = |module: &str| LAYERS.iter().position(|layer| *layer == module);
    match (user, used) {
        _ if user == used => true,
        ("output" | "text", _) => false,
        (_, "image" | "output" | "text") => true,
        ("reference" | "metrics", used) => used == "scene",
        ("measure" | "view" | "cli", "reference" | "metrics") => true,
        ("view", "measure") => false,
        (user, used) => matches!((rank(user), rank(used)), (Some(user), Some(used)) if used < user),
    }
}

/// The family of a module of `gi` (a folder that is not shared), and in it the technique's own
/// folder.
fn family(tree: &Tree, module: &[String]) -> Option<Vec<String>> {
    let is_folder = |part: &[String]| tree.files.get(part).is_some_and(|file| file.is_folder);
    let is_own = module.len() > 1 && module[0] == "gi" && module[1] != "shared";
    if !is_own || !is_folder(&module[..2]) {
        return None;
    }
    let own = if module.len() > 2 && is_folder(&module[..3]) {
        3
    } else {
        2
    };
    Some(module[1..own].to_vec())
}

/// Whether a module of `gi` may know of another: a family knows itself, a folder in it not the one
/// beside it, and only the registry knows families.
fn may_know(tree: &Tree, user: &[String], used: &[String]) -> bool {
    let Some(other) = family(tree, used) else {
        return true;
    };
    if user == ["gi", "registry"] {
        return true;
    }
    let own = family(tree, user);
    own.is_some_and(|own| own.starts_with(&other) || other.starts_with(&own))
}

struct File {
    path: PathBuf,
    is_folder: bool,
    /// What the code names, as absolute paths.
    uses: Vec<Module>,
    /// Names that it re-exports, and where they are.
    exports: BTreeMap<String, Module>,
}

struct Tree {
    files: BTreeMap<Module, File>,
}

/// Identifiers and punctuation of the code before its unit tests; comments, strings and characters
/// left out.
fn tokens(code: &str) -> Vec<String> {
    let code = code.split("#[cfg(test)]\nmod tests").next().unwrap_or(code);
    let chars: Vec<char> = code.chars().collect();
    let (mut tokens, mut at) = (Vec::new(), 0);
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    while at < chars.len() {
        let rest = &chars[at..];
        match rest {
            ['/', '/', ..] => at += rest.iter().take_while(|c| **c != '\n').count(),
            ['"', ..] => {
                at += 1;
                while at < chars.len() && chars[at] != '"' {
                    at += if chars[at] == '\\' { 2 } else { 1 };
                }
                at += 1;
            }
            ['\'', '\\', _, '\'', ..] => at += 4,
            ['\'', _, '\'', ..] => at += 3,
            [':', ':', ..] => {
                tokens.push("::".to_owned());
                at += 2;
            }
            [c, ..] if is_word(*c) => {
                let word: String = rest.iter().take_while(|c| is_word(**c)).collect();
                at += word.chars().count();
                tokens.push(word);
            }
            [c, ..] => {
                if !c.is_whitespace() {
                    tokens.push(c.to_string());
                }
                at += 1;
            }
            [] => break,
        }
    }
    tokens
}

/// The paths of a `use` tree that begins at `at`, and where it ends.
fn use_tree(tokens: &[String], mut at: usize, prefix: &[String]) -> (Vec<Module>, usize) {
    let (mut path, mut found) = (prefix.to_vec(), Vec::new());
    while at < tokens.len() {
        match tokens[at].as_str() {
            "{" => {
                at += 1;
                while tokens[at] != "}" {
                    let (inner, end) = use_tree(tokens, at, &path);
                    found.extend(inner);
                    at = if tokens[end] == "," { end + 1 } else { end };
                }
                return (found, at + 1);
            }
            "," | "}" | ";" => break,
            "as" => at += 2,
            "::" | "*" => at += 1,
            "self" if path.len() > prefix.len() || !prefix.is_empty() => at += 1,
            name => {
                path.push(name.to_owned());
                at += 1;
            }
        }
    }
    found.push(path);
    (found, at)
}

impl Tree {
    fn read(src: &Path) -> Tree {
        let mut tree = Tree {
            files: BTreeMap::new(),
        };
        for path in crate::repository::files(src) {
            let relative = path.strip_prefix(src).unwrap().with_extension("");
            let names = relative
                .iter()
                .map(|name| name.to_str().unwrap().to_owned());
            let mut module: Module = names.collect();
            let is_rust = path.extension().is_some_and(|kind| kind == "rs");
            let is_test = module.last().is_some_and(|name| name == "tests");
            if !is_rust || is_test || module == ["main"] || module == ["lib"] {
                continue;
            }
            let is_folder = module.last().is_some_and(|name| name == "mod");
            if is_folder {
                module.pop();
            }
            let (uses, exports) = (Vec::new(), BTreeMap::new());
            let file = File {
                path,
                is_folder,
                uses,
                exports,
            };
            tree.files.insert(module, file);
        }
        let modules: Vec<Module> = tree.files.keys().cloned().collect();
        for module in modules {
            let code = std::fs::read_to_string(&tree.files[&module].path).unwrap();
            let (uses, exports) = tree.named(&module, &tokens(&code));
            let file = tree.files.get_mut(&module).unwrap();
            (file.uses, file.exports) = (uses, exports);
        }
        tree
    }

    /// The absolute path of one that is written in a module; `None` where it is not of this crate.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Module> {
        let child = |name: &String| {
            let child: Module = module.iter().chain([name]).cloned().collect();
            self.files.contains_key(&child)
        };
        let first = path.first()?;
        let ups = path.iter().take_while(|name| *name == "super").count();
        let (base, rest) = match first.as_str() {
            "crate" => (&module[..0], &path[1..]),
            "self" => (module, &path[1..]),
            "super" => (&module[..module.len().saturating_sub(ups)], &path[ups..]),
            _ if child(first) => (module, path),
            _ => return None,
        };
        Some(base.iter().chain(rest).cloned().collect())
    }

    /// What the code of a module uses and re-exports.
    fn named(
        &self,
        module: &[String],
        tokens: &[String],
    ) -> (Vec<Module>, BTreeMap<String, Module>) {
        let (mut uses, mut exports) = (Vec::new(), BTreeMap::new());
        let (mut at, mut is_public) = (0, false);
        while at < tokens.len() {
            let token = tokens[at].as_str();
            if token == "pub" {
                is_public = true;
                at += 1;
                if tokens.get(at).is_some_and(|next| next == "(") {
                    at += tokens[at..]
                        .iter()
                        .take_while(|token| *token != ")")
                        .count()
                        + 1;
                }
                continue;
            }
            if token == "use" {
                let (paths, end) = use_tree(tokens, at + 1, &[]);
                for path in paths.iter().filter_map(|path| self.absolute(module, path)) {
                    if is_public {
                        exports.insert(path.last().cloned().unwrap_or_default(), path);
                    } else {
                        uses.push(path);
                    }
                }
                (at, is_public) = (end, false);
                continue;
            }
            is_public = false;
            let starts = at == 0 || tokens[at - 1] != "::";
            if starts && tokens.get(at + 1).is_some_and(|next| next == "::") {
                let mut path = vec![token.to_owned()];
                while tokens.get(at + 1).is_some_and(|next| next == "::") {
                    at += 2;
                    path.extend(tokens.get(at).cloned());
                }
                uses.extend(self.absolute(module, &path));
            }
            at += 1;
        }
        (uses, exports)
    }

    /// The module in which a name is defined, through re-exports.
    fn resolve(&self, path: &[String], depth: u32) -> Option<Module> {
        let known = (1..=path.len())
            .rev()
            .find(|end| self.files.contains_key(&path[..*end]))?;
        let (module, rest) = path.split_at(known);
        let export = rest
            .first()
            .and_then(|name| self.files[module].exports.get(name));
        match export {
            Some(target) if depth < 16 => {
                let path: Module = target.iter().chain(&rest[1..]).cloned().collect();
                self.resolve(&path, depth + 1)
            }
            _ => Some(module.to_vec()),
        }
    }

    /// Which modules each module uses.
    fn edges(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let of = |(module, file): (&Module, &File)| {
            let used = file.uses.iter().filter_map(|path| self.resolve(path, 0));
            (module.clone(), used.filter(|used| used != module).collect())
        };
        self.files.iter().map(of).collect()
    }
}

/// All that can be reached from a module.
fn reached(edges: &BTreeMap<Module, BTreeSet<Module>>, from: &Module) -> BTreeSet<Module> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from.clone()]);
    while let Some(module) = open.pop() {
        for next in &edges[&module] {
            if seen.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    seen
}

fn tree() -> Tree {
    Tree::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
}

#[test]
fn modules_keep_their_layers() {
    let tree = tree();
    for (user, used) in tree.edges() {
        for used in used {
            let (from, to) = (user.join("::"), used.join("::"));
            assert!(may_use(&user[0], &used[0]), "{from} must not use {to}");
            let is_gi = user[0] == "gi" && used[0] == "gi";
            assert!(
                !is_gi || may_know(&tree, &user, &used),
                "{from} must not know {to}"
            );
        }
    }
}

/// Files of one folder may use each other in a circle; files of two folders may not.
#[test]
fn no_circle_of_files_goes_through_two_folders() {
    let tree = tree();
    let edges = tree.edges();
    let reached: BTreeMap<&Module, BTreeSet<Module>> = edges
        .keys()
        .map(|module| (module, reached(&edges, module)))
        .collect();
    let folder = |module: &Module| tree.files[module].path.parent().unwrap().to_owned();
    for (one, from_one) in &reached {
        for other in from_one
            .iter()
            .filter(|other| reached[other].contains(*one))
        {
            let (from, to) = (one.join("::"), other.join("::"));
            assert_eq!(folder(one), folder(other), "{from} and {to} use each other");
        }
    }
}

/// What a shader in `shared` includes is shared, and a family includes no other family.
#[test]
fn shaders_keep_their_layers() {
    let glsl = Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl");
    let owner = |path: &str| -> Vec<String> {
        let parts: Vec<&str> = path.split('/').collect();
        match parts[..] {
            ["gi", "shared", ..] => vec!["shared".into()],
            ["test", ..] => vec!["test".into()],
            ["gi", family, technique, _, ..] => vec![family.into(), technique.into()],
            ["gi", family, ..] => vec![family.into()],
            _ => Vec::new(),
        }
    };
    let mut includes = 0;
    for path in crate::repository::files(&glsl) {
        let user = path
            .strip_prefix(&glsl)
            .unwrap()
            .to_str()
            .unwrap()
            .to_owned();
        let code = std::fs::read_to_string(&path).unwrap();
        let lines = code
            .lines()
            .filter_map(|line| line.strip_prefix("#include \""));
        for used in lines.map(|line| line.trim_end_matches('"')) {
            let (from, to) = (owner(&user), owner(used));
            // Shaders of tests try what any technique has.
            let is_allowed = to.is_empty()
                || from == ["test"]
                || (to == ["shared"] && !from.is_empty())
                || (!to.is_empty() && from.starts_with(&to));
            assert!(is_allowed, "{user} must not include {used}");
            includes += 1;
        }
    }
    assert!(includes > 100);
}

#[test]
fn layering_is_not_vacuous() {
    assert!(!may_use("vulkan", "graph") && !may_use("reference", "gi") && !may_use("gi", "frame"));
    let tree = tree();
    let module = |path: &str| path.split("::").map(str::to_owned).collect::<Module>();
    let knows = |user: &str, used: &str| may_know(&tree, &module(user), &module(used));
    assert!(!knows("gi::shared::cone::tracer", "gi::voxel_cones::store"));
    assert!(!knows(
        "gi::voxel_cones::svo::nodes",
        "gi::voxel_cones::mips::matter"
    ));
    assert!(!knows("gi::none", "gi::voxel_cones") && knows("gi::registry", "gi::none"));
    assert!(knows(
        "gi::voxel_cones::svo::nodes",
        "gi::voxel_cones::store"
    ));
    // Through `super::`, a child and a re-export.
    let resolve = |user: &str, path: &str| {
        let absolute = tree.absolute(&module(user), &module(path)).unwrap();
        tree.resolve(&absolute, 0).unwrap().join("::")
    };
    assert_eq!(
        resolve("gi::shared::voxel::dynamic", "super::VoxelGrid"),
        "gi::shared::voxel::grid"
    );
    assert_eq!(
        resolve("gi::shared::voxel", "build::passes::Voxel"),
        "gi::shared::voxel::build::passes"
    );
    let found = tokens("use a::{b, c as d}; // crate::x\nlet s = \"crate::y\"; 'c'");
    assert_eq!(found.join(" "), "use a :: { b , c as d } ; let s = ;");
    let (paths, _) = use_tree(&found, 1, &[]);
    assert_eq!(paths, [["a", "b"], ["a", "c"]]);
    // And there is something to see.
    let edges = tree.edges();
    assert!(edges[&module("gi::registry")].contains(&module("gi::none")));
    assert!(edges.values().map(BTreeSet::len).sum::<usize>() > 400);
}
