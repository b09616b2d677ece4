//! Which file imports from which, with re-exports followed to the file that defines the name.

use crate::source::{Named, Source};
use std::collections::{BTreeMap, BTreeSet};

pub struct Graph {
    pub files: Vec<Source>,
    /// Place of a file by its module.
    places: BTreeMap<Vec<String>, usize>,
    named: Vec<Vec<Named>>,
    /// Files that every file imports from.
    pub edges: Vec<BTreeSet<usize>>,
}

impl Graph {
    pub fn new(files: Vec<Source>) -> Self {
        let places = files.iter().enumerate().map(|(at, file)| (file.module.clone(), at)).collect();
        let named = files.iter().map(Source::named).collect();
        let mut graph = Self { files, places, named, edges: Vec::new() };
        graph.edges = (0..graph.files.len()).map(|at| graph.imports_of(at)).collect();
        graph
    }

    fn imports_of(&self, at: usize) -> BTreeSet<usize> {
        let file = &self.files[at];
        let imported = self.named[at].iter().filter(|named| {
            // A name that is only handed on is not used here.
            named.alias.as_ref().is_none_or(|name| file.mentions(name)) || !self.is_child(file, named)
        });
        imported
            .filter_map(|named| self.place_of(&file.module, &named.segments, 0))
            .filter(|to| *to != at)
            .collect()
    }

    fn is_child(&self, file: &Source, named: &Named) -> bool {
        let first = named.segments.iter().find(|name| *name != "self").cloned().unwrap_or_default();
        let child: Vec<_> = file.module.iter().cloned().chain([first]).collect();
        self.places.contains_key(&child)
    }

    /// The file that defines what a path names in a module, or None for what is not of this crate.
    fn place_of(&self, module: &[String], path: &[String], depth: usize) -> Option<usize> {
        let mut base = match path[0].as_str() {
            "crate" => Vec::new(),
            "self" | "super" => module.to_vec(),
            child => {
                let inside: Vec<_> = module.iter().cloned().chain([child.to_owned()]).collect();
                return match self.places.contains_key(&inside) {
                    true => self.walk(module.to_vec(), path, depth),
                    false => None,
                };
            }
        };
        let mut rest = path;
        while let Some(name) = rest.first().filter(|name| ["crate", "self", "super"].contains(&name.as_str()))
        {
            if name == "super" {
                base.pop();
            }
            rest = &rest[1..];
        }
        self.walk(base, rest, depth)
    }

    fn walk(&self, mut base: Vec<String>, path: &[String], depth: usize) -> Option<usize> {
        for name in path {
            base.push(name.clone());
            if self.places.contains_key(&base) {
                continue;
            }
            base.pop();
            let at = *self.places.get(&base)?;
            let handed_on = self.named[at].iter().find(|named| named.alias.as_ref() == Some(name));
            return match handed_on {
                Some(named) if depth < 8 => self.place_of(&base, &named.segments, depth + 1),
                _ => Some(at),
            };
        }
        self.places.get(&base).copied()
    }

    /// Files that import from each other in a circle, the first circle found. A child may use what the module around it
    /// defines, except in files that `is_strict` names.
    pub fn circle(&self, is_strict: impl Fn(&str) -> bool) -> Option<Vec<&str>> {
        let is_strict = &is_strict;
        let inner = |from: usize| {
            let edges = self.edges[from].iter().copied();
            let file = &self.files[from];
            edges.filter(move |to| is_strict(&file.path) || !self.files[*to].contains(file))
        };
        let mut state = vec![State::New; self.files.len()];
        let mut path = Vec::new();
        (0..self.files.len())
            .find_map(|from| visit(from, &inner, &mut state, &mut path))
            .map(|circle| circle.into_iter().map(|at| self.files[at].path.as_str()).collect())
    }
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    New,
    Open,
    Done,
}

fn visit<I: Iterator<Item = usize>>(
    at: usize,
    edges: &impl Fn(usize) -> I,
    state: &mut [State],
    path: &mut Vec<usize>,
) -> Option<Vec<usize>> {
    match state[at] {
        State::Done => return None,
        State::Open => {
            let start = path.iter().position(|other| *other == at).unwrap_or(0);
            return Some(path[start..].to_vec());
        }
        State::New => {}
    }
    state[at] = State::Open;
    path.push(at);
    let found = edges(at).find_map(|to| visit(to, edges, state, path));
    path.pop();
    state[at] = State::Done;
    found
}
