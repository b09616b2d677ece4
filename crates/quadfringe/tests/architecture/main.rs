//! Direction of imports, file by file: a room uses only what stands above it, the two halves never meet, the two methods
//! never meet, and no files import each other in a circle.

mod graph;
mod source;

use graph::Graph;
use source::{Source, sources};
use std::collections::BTreeSet;

/// Rooms in the order of `lib.rs`. A file belongs to the longest name that its path begins with: what every method of
/// decoding takes and gives stands above the methods, the decoder that chooses between them below.
const ORDER: [&str; 19] = [
    "error",
    "parallel",
    "encoding",
    "optics",
    "surface",
    "rig",
    "condition",
    "decode/reason",
    "stages",
    "height",
    "mesh",
    "decode/params",
    "decode/method",
    "decode/options",
    "decode/output",
    "published",
    "joint",
    "decode",
    "reference",
];
const FORWARD: [&str; 2] = ["surface", "rig"];
/// The inverse half begins here.
const INVERSE_FROM: &str = "condition";
const METHODS: [&str; 2] = ["published", "joint"];

/// Rooms in which a child and the module around it may use each other: types that all files of the room share stand in its
/// `mod.rs`.
const SHARING: [&str; 6] = ["optics", "surface", "condition", "stages", "mesh", "published"];

fn is_strict(path: &str) -> bool {
    room_of(path).is_none_or(|room| !SHARING.contains(&ORDER[room]))
}

/// Place in the order of the room that a file belongs to.
fn room_of(path: &str) -> Option<usize> {
    let bare = path.strip_suffix(".rs").unwrap_or(path);
    let inside =
        |room: &&str| bare == *room || bare.strip_prefix(*room).is_some_and(|rest| rest.starts_with('/'));
    let rooms = ORDER.iter().enumerate().filter(|(_, room)| inside(room));
    rooms.max_by_key(|(_, room)| room.len()).map(|(place, _)| place)
}

/// Imports that break a rule, each in words.
fn faults(graph: &Graph) -> Vec<String> {
    let mut found = Vec::new();
    for (from, edges) in graph.files.iter().zip(&graph.edges).filter(|(file, _)| file.path != "lib.rs") {
        for to in edges.iter().map(|to| &graph.files[*to]) {
            found.extend(
                fault(&from.path, &to.path).map(|why| format!("{} uses {}: {why}", from.path, to.path)),
            );
        }
        if room_of(&from.path).is_none() {
            found.push(format!("{} has no place in the order", from.path));
        }
    }
    found.extend(
        graph.circle(is_strict).map(|circle| format!("a circle of imports: {}", circle.join(" -> "))),
    );
    found
}

fn fault(from: &str, to: &str) -> Option<&'static str> {
    let Some(there) = room_of(to) else { return Some("the name is not of any room") };
    let here = room_of(from)?;
    let is_forward = |room: usize| FORWARD.contains(&ORDER[room]);
    let is_inverse = |room: usize| ORDER[..=room].contains(&INVERSE_FROM);
    if (is_forward(here) && is_inverse(there)) || (is_inverse(here) && is_forward(there)) {
        return Some("the forward and the inverse half must not meet");
    }
    if here != there && [here, there].iter().all(|room| METHODS.contains(&ORDER[*room])) {
        return Some("the two methods must not meet");
    }
    (there > here).then_some("that room stands below")
}

#[test]
fn imports_go_upwards_never_between_the_halves_or_the_methods_and_never_in_a_circle() {
    let graph = Graph::new(sources());
    assert!(graph.files.len() > 80, "{} files", graph.files.len());
    let edges: usize = graph.edges.iter().map(BTreeSet::len).sum();
    assert!(edges > 200, "{edges} imports");
    let faults = faults(&graph);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_order_is_that_of_the_crate() {
    let files = sources();
    let lib = files.iter().find(|file| file.path == "lib.rs").expect("a root");
    let lines = lib.code.lines().filter_map(|line| {
        let line = line.strip_prefix("pub ").unwrap_or(line);
        line.strip_prefix("mod ")?.strip_suffix(';')
    });
    let rooms = ORDER.iter().copied().filter(|room| !room.contains('/'));
    assert_eq!(lines.collect::<Vec<_>>(), rooms.collect::<Vec<_>>());
}

#[test]
fn folders_hold_their_module() {
    let files = sources();
    let doubled = |file: &&Source| {
        let folder = format!("{}/", file.path.strip_suffix(".rs").expect("a Rust file"));
        files.iter().any(|other| other.path.starts_with(&folder))
    };
    let found: Vec<_> = files.iter().filter(doubled).map(|file| &file.path).collect();
    assert!(found.is_empty(), "next to a folder of the same name, in place of its mod.rs: {found:?}");
}

/// A crate of a few files, whose root re-exports as the true one does.
fn planted(files: &[(&str, &str)]) -> Graph {
    let root =
        ("lib.rs", "pub use error::Error;\npub use condition::Shot;\npub use decode::{Decoder, Options};");
    let rooms = [
        ("error.rs", "pub enum Error {}"),
        ("condition/mod.rs", "mod shot;\npub use shot::Shot;"),
        ("condition/shot.rs", "pub struct Shot;"),
        ("surface/mod.rs", "pub trait Surface {}"),
        ("rig/mod.rs", "pub struct Bench;"),
        ("published/mod.rs", "pub struct Published;"),
        ("decode/mod.rs", "pub mod options;\npub use options::Options;\npub struct Decoder;"),
        ("decode/options.rs", "pub struct Options;"),
        ("joint/mod.rs", "mod a;\nmod b;\nmod c;\npub struct Parent;"),
    ];
    let kept = rooms.iter().filter(|(path, _)| files.iter().all(|(other, _)| other != path));
    Graph::new([root].iter().chain(kept).chain(files).map(|(path, text)| Source::new(path, text)).collect())
}

#[test]
fn the_check_sees_an_import_that_breaks_the_order() {
    let bad = [
        ("rig/light.rs", "use crate::decode::Decoder;"),
        ("rig/light.rs", "use crate::{Error, Shot};"),
        ("surface/plane.rs", "use crate::rig::Bench;"),
        ("condition/plan.rs", "fn f() -> crate::surface::Plane {}"),
        ("condition/plan.rs", "use crate::{\n    Error,\n    decode::{options::Options, Decoder},\n};"),
        ("decode/output.rs", "use crate::rig::Bench;"),
        ("decode/options.rs", "use crate::joint::Parent;"),
        ("rig/light.rs", "use super::super::decode::Decoder;"),
        ("joint/a.rs", "use crate::published::Published;"),
        ("published/mod.rs", "fn f(parent: crate::joint::Parent) {}"),
        ("encoding/mod.rs", "use crate::nowhere::Thing;"),
        ("elsewhere.rs", "use crate::Error;"),
    ];
    for (path, text) in bad {
        assert!(!faults(&planted(&[(path, text)])).is_empty(), "{path}: {text}");
    }
    let good = [
        ("rig/light.rs", "use crate::surface::Surface;"),
        (
            "decode/mod.rs",
            "use crate::{Error, Shot};\npub(crate) use crate::joint::Parent;\nfn f(_: Parent) {}",
        ),
        ("joint/a.rs", "use crate::Options;\nuse super::Parent;"),
        ("rig/light.rs", "/// use crate::decode::Decoder;"),
        ("condition/plan.rs", "pub struct Plan;\n#[cfg(test)]\nmod tests { use crate::rig::Bench; }"),
        ("condition/plan.rs", "use rayon::prelude::*;\nuse std::fmt;"),
    ];
    for (path, text) in good {
        assert_eq!(faults(&planted(&[(path, text)])), [""; 0], "{path}: {text}");
    }
}

#[test]
fn the_check_sees_a_circle() {
    let circles: [&[(&str, &str)]; 4] = [
        // Straight, and over three files.
        &[("joint/a.rs", "use super::b::B;"), ("joint/b.rs", "use crate::joint::a::A;")],
        &[
            ("joint/a.rs", "use super::b::B;"),
            ("joint/b.rs", "fn f() { super::c::f() }"),
            ("joint/c.rs", "use crate::joint::a::{A, other as O};"),
        ],
        // By a name that the parent hands on.
        &[
            ("joint/mod.rs", "mod a;\nmod b;\npub use a::A;"),
            ("joint/a.rs", "use super::b::B;\npub struct A;"),
            ("joint/b.rs", "use super::A;"),
        ],
        // From a child of another folder back.
        &[
            ("joint/a.rs", "use super::b::B;"),
            ("joint/b/mod.rs", "mod deep;\nuse deep::D;\nfn f(_: D) {}"),
            ("joint/b/deep.rs", "use crate::joint::a::A;"),
        ],
    ];
    for files in circles {
        let found = planted(files).circle(|_| false).map(|circle| circle.len());
        assert!(found.is_some_and(|count| count >= 2), "{files:?}");
    }
    let lines: [&[(&str, &str)]; 3] = [
        &[
            ("joint/a.rs", "use super::b::B;"),
            ("joint/b.rs", "use super::c::C;"),
            ("joint/c.rs", "use super::Parent;"),
        ],
        // A parent that hands on what its child makes of the parent's type.
        &[
            ("joint/mod.rs", "mod a;\npub use a::A;\npub struct Parent;"),
            ("joint/a.rs", "use super::Parent;\npub struct A;"),
        ],
        &[("joint/a.rs", "// use super::b::B;\n"), ("joint/b.rs", "use super::a::A;")],
    ];
    for files in lines {
        assert_eq!(planted(files).circle(|_| false), None, "{files:?}");
    }
}

#[test]
fn the_check_sees_a_circle_of_child_and_parent_where_it_is_strict() {
    let graph = planted(&[
        ("joint/mod.rs", "mod a;\nuse a::A;\npub struct Parent;\nfn f(_: A) {}"),
        ("joint/a.rs", "use super::Parent;\npub struct A;"),
    ]);
    assert_eq!(graph.circle(|_| false), None);
    assert!(graph.circle(|path| path.starts_with("joint")).is_some());
}

/// The result depends on the arguments alone: nothing asks the environment, files or the console.
#[test]
fn the_kernel_asks_nobody_else() {
    for file in sources() {
        for word in ["std::env", "std::fs", "println!", "dbg!"] {
            assert!(!file.code.contains(word), "{}: {word}", file.path);
        }
    }
}
