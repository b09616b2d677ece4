//! Direction of imports: a module uses only what stands above it, and the two halves never meet.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules in the order of `lib.rs`.
const ORDER: [&str; 12] = [
    "error",
    "angle",
    "slots",
    "fringe",
    "optics",
    "surface",
    "rig",
    "condition",
    "demod",
    "unwrap",
    "height",
    "decode",
];
const FORWARD: [&str; 2] = ["surface", "rig"];
const INVERSE: [&str; 5] = ["condition", "demod", "unwrap", "height", "decode"];

/// Where the names at the root of the crate come from.
const ROOT_NAMES: [(&str, &str); 13] = [
    ("Error", "error"),
    ("Result", "error"),
    ("Channel", "fringe"),
    ("DmdLayout", "fringe"),
    ("FringeCode", "fringe"),
    ("BayerPattern", "optics"),
    ("Device", "optics"),
    ("Conditioner", "condition"),
    ("Response", "condition"),
    ("Shot", "condition"),
    ("Decoded", "decode"),
    ("Decoder", "decode"),
    ("Options", "decode"),
];

fn sources() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("sources are there");
    let paths = entries.map(|entry| entry.expect("readable").path());
    paths
        .flat_map(|path| match path.is_dir() {
            true => rust_files(&path),
            false => vec![path],
        })
        .filter(|path| path.extension().is_some_and(|e| e == "rs"))
        .collect()
}

/// Module of a file: the first part of its path below `src`.
fn module_of(file: &Path) -> String {
    let below = file.strip_prefix(sources()).expect("a source");
    let first = below.components().next().expect("not empty");
    let name = Path::new(first.as_os_str()).with_extension("");
    name.to_string_lossy().into_owned()
}

/// Code without comments and without its unit tests, which may use anything.
fn code_of(text: &str) -> String {
    let code = text.split("\n#[cfg(test)]").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap());
    lines.collect::<Vec<_>>().join("\n")
}

/// Module behind a name at the root of the crate; a name that is unknown stands for itself and fails.
fn module_named(name: &str) -> String {
    let known = ROOT_NAMES.iter().find(|(root, _)| *root == name);
    known.map_or(name, |(_, module)| module).to_owned()
}

/// Modules that a text reaches by `crate::name` or `crate::{name, name::{more, most}}`.
fn used_by(text: &str) -> Vec<String> {
    let code = code_of(text);
    let roots = code.split("crate::").skip(1).flat_map(first_names);
    roots.map(|name| module_named(&name)).collect()
}

/// The first name of every path after `crate::`.
fn first_names(rest: &str) -> Vec<String> {
    let name_of = |path: &str| -> String {
        let path = path.trim_start().chars();
        path.take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let Some(list) = rest.strip_prefix('{') else {
        return vec![name_of(rest)];
    };
    let (mut depth, mut start, mut found) = (1, 0, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 || (depth == 1 && c == ',') {
            found.push(name_of(&list[start..at]));
            start = at + 1;
        }
        if depth == 0 {
            break;
        }
    }
    found.retain(|name| !name.is_empty());
    found
}

/// What is wrong with a text of a module, if anything.
fn fault(module: &str, text: &str) -> Option<String> {
    let place = |name: &str| ORDER.iter().position(|m| *m == name);
    let here = place(module)?;
    if code_of(text).contains("super::super") {
        return Some(format!("{module} climbs out of its folder by super"));
    }
    used_by(text).into_iter().find_map(|used| {
        let half = |names: &[&str], name: &str| names.contains(&name);
        let across = (half(&FORWARD, module) && half(&INVERSE, &used))
            || (half(&INVERSE, module) && half(&FORWARD, &used));
        match place(&used) {
            Some(there) if there <= here && !across => None,
            Some(_) => Some(format!("{module} uses {used}")),
            None => Some(format!("{module} uses {used}, which has no place in the order")),
        }
    })
}

#[test]
fn imports_go_upwards_and_never_between_the_halves() {
    let files = rust_files(&sources());
    assert!(files.len() > 20, "{} files", files.len());
    let faults: Vec<String> = files
        .iter()
        .filter_map(|file| {
            let mut text = fs::read_to_string(file).expect("readable");
            if file.parent() == Some(&sources()) {
                text = text.replace("super::", "crate::");
            }
            let fault = fault(&module_of(file), &text)?;
            Some(format!("{}: {fault}", file.display()))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_order_is_that_of_the_crate() {
    let text = fs::read_to_string(sources().join("lib.rs")).expect("readable");
    let lines = text.lines().filter_map(|line| {
        let line = line.strip_prefix("pub ").unwrap_or(line);
        line.strip_prefix("mod ")?.strip_suffix(';')
    });
    assert_eq!(lines.collect::<Vec<_>>(), ORDER);
}

#[test]
fn the_check_sees_what_it_must() {
    let bad = [
        ("rig", "use crate::decode::Decoder;"),
        ("rig", "use crate::{Error, Shot};"),
        ("surface", "use crate::rig::Bench;"),
        ("condition", "fn f() -> crate::surface::Plane {}"),
        ("demod", "use crate::{\n    Error,\n    unwrap::Ladder,\n};"),
        ("decode", "use crate::rig::Bench;"),
        ("demod", "use crate::{condition::{Plan, Shot}, decode::Decoder};"),
        ("rig", "use super::super::decode::Decoder;"),
        ("fringe", "use crate::nowhere::Thing;"),
    ];
    for (module, text) in bad {
        assert!(fault(module, text).is_some(), "{module}: {text}");
    }
    let good = [
        ("rig", "use crate::surface::Surface;"),
        ("decode", "use crate::{Conditioner, Error, FringeCode};"),
        ("rig", "/// use crate::decode::Decoder;"),
        ("condition", "\n#[cfg(test)]\nmod tests { use crate::rig::Bench; }"),
    ];
    for (module, text) in good {
        assert_eq!(fault(module, text), None, "{module}: {text}");
    }
}

/// The result depends on the arguments alone: nothing asks the environment, files or the console.
#[test]
fn the_kernel_asks_nobody_else() {
    for file in rust_files(&sources()) {
        let code = code_of(&fs::read_to_string(&file).expect("readable"));
        for word in ["std::env", "std::fs", "println!", "dbg!"] {
            assert!(!code.contains(word), "{}: {word}", file.display());
        }
    }
}
