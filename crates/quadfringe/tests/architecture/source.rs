//! The files of the crate as the checks see them: code without comments and unit tests, and the paths that it names.

use std::fs;
use std::path::{Path, PathBuf};

/// One source file.
pub struct Source {
    /// Path below `src`, with `/`.
    pub path: String,
    /// Names of its module from the root of the crate on.
    pub module: Vec<String>,
    pub code: String,
}

/// A path that a file names, such as `crate::optics::Device`.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    pub segments: Vec<String>,
    /// Name under which a `use` brings it into the file.
    pub alias: Option<String>,
}

impl Source {
    pub fn new(path: &str, text: &str) -> Self {
        let bare = path.strip_suffix(".rs").expect("a Rust file");
        let bare = bare.strip_suffix("/mod").unwrap_or(if bare == "lib" { "" } else { bare });
        let module = bare.split('/').filter(|name| !name.is_empty()).map(str::to_owned).collect();
        Self { path: path.to_owned(), module, code: code_of(text) }
    }

    /// Whether another file's module lies inside the module of this one.
    pub fn contains(&self, other: &Self) -> bool {
        other.module.len() > self.module.len() && other.module.starts_with(&self.module)
    }

    /// All paths that the file names: those of its `use` declarations, and those within the code.
    pub fn named(&self) -> Vec<Named> {
        let mut found = Vec::new();
        let mut rest = String::new();
        let mut code = self.code.as_str();
        while let Some((before, tree, after)) = next_use(code) {
            rest.push_str(before);
            expand(tree, &[], &mut found);
            code = after;
        }
        rest.push_str(code);
        found.extend(inline_paths(&rest));
        found
    }

    /// Whether the file uses a name other than by declaring or importing it.
    pub fn mentions(&self, name: &str) -> bool {
        let mut code = self.code.as_str();
        let mut rest = String::new();
        while let Some((before, _, after)) = next_use(code) {
            rest.push_str(before);
            code = after;
        }
        rest.push_str(code);
        rest.split(|c: char| !is_of_name(c)).any(|word| word == name)
    }
}

/// All files of the crate.
pub fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let read = |file: PathBuf| {
        let below = file.strip_prefix(&root).expect("a source");
        let names: Vec<_> = below.components().map(|part| part.as_os_str().to_string_lossy()).collect();
        Source::new(&names.join("/"), &fs::read_to_string(&file).expect("readable"))
    };
    rust_files(&root).into_iter().map(read).collect()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("sources are there");
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.sort();
    let files = paths.into_iter().flat_map(|path| if path.is_dir() { rust_files(&path) } else { vec![path] });
    files.filter(|path| path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs")).collect()
}

/// Code without comments and without unit tests, which may use anything.
fn code_of(text: &str) -> String {
    let code = text.split("\n#[cfg(test)]").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    let code = lines.collect::<Vec<_>>().join("\n");
    // A visibility names a module without using it.
    let mut pieces = code.split("pub(in ");
    let mut kept = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        kept.push_str("pub ");
        kept.push_str(piece.split_once(')').map_or("", |(_, rest)| rest));
    }
    kept
}

fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The next `use` declaration: the text before it, its tree, and the text behind it.
fn next_use(code: &str) -> Option<(&str, &str, &str)> {
    let mut from = 0;
    while let Some(found) = code[from..].find("use ") {
        let at = from + found;
        if !code[..at].ends_with(is_of_name) {
            let end = at + code[at..].find(';')?;
            return Some((&code[..at], &code[at + 4..end], &code[end + 1..]));
        }
        from = at + 4;
    }
    None
}

/// Paths of a `use` tree below a prefix.
fn expand(tree: &str, prefix: &[String], found: &mut Vec<Named>) {
    let tree = tree.trim();
    if let Some((head, list)) = tree.split_once('{') {
        let names = head.split("::").map(str::trim).filter(|name| !name.is_empty());
        let prefix: Vec<_> = prefix.iter().cloned().chain(names.map(str::to_owned)).collect();
        let list = list.rsplit_once('}').map_or(list, |(list, _)| list);
        split_list(list).into_iter().for_each(|part| expand(part, &prefix, found));
        return;
    }
    let (path, alias) = tree.split_once(" as ").unwrap_or((tree, ""));
    let names = path.split("::").map(str::trim).filter(|name| !name.is_empty());
    let mut segments: Vec<_> = prefix.iter().cloned().chain(names.map(str::to_owned)).collect();
    if segments.len() > prefix.len() && segments.len() > 1 && segments.last().is_some_and(|n| n == "self") {
        segments.pop();
    }
    let last = segments.last().cloned().unwrap_or_default();
    let alias = if alias.trim().is_empty() { last } else { alias.trim().to_owned() };
    if !segments.is_empty() {
        found.push(Named { segments, alias: Some(alias) });
    }
}

/// Parts of a list between commas that no inner braces hold.
fn split_list(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&list[start..]);
    parts.into_iter().filter(|part| !part.trim().is_empty()).collect()
}

/// Paths of at least two names in code.
fn inline_paths(code: &str) -> Vec<Named> {
    let words = code.split(|c: char| !is_of_name(c) && c != ':');
    let paths = words.map(|word| word.split("::").filter(|name| !name.is_empty()).map(str::to_owned));
    let named = paths.map(|names| Named { segments: names.collect(), alias: None });
    named.filter(|named| named.segments.len() > 1).collect()
}
