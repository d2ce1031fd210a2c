//! What a cause costs: its file, its lines in the list, its page, its twin. Whoever adds one changes nothing else, so
//! product code names no cause outside its own file.
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use giotto::causes::ALL;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders of product code.
const PRODUCT: [&str; 10] = [
    "shared/src",
    "firmware/src",
    "firmware/corrector/src",
    "firmware/linuxcnc/src",
    "host/src",
    "host/nc/src",
    "host/link/src",
    "host/report/src",
    "host/cli/src",
    "host/bridge/src",
];

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_path_buf()
}

/// All sources under a folder.
fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// Files and folders that are compiled for tests alone: `#[cfg(test)] mod NAME;`, further attributes between.
fn only_for_tests(file: &Path, text: &str) -> Vec<PathBuf> {
    let inside = match file.file_stem().and_then(|stem| stem.to_str()) {
        Some("mod" | "lib" | "main") => file.parent().unwrap().to_path_buf(),
        _ => file.with_extension(""),
    };
    let mut found = Vec::new();
    for after in text.split("#[cfg(test)]").skip(1) {
        let head: String = after
            .chars()
            .take_while(|c| *c != ';' && *c != '{')
            .collect();
        // Attributes may hold braces or semicolons; none of ours before a module does.
        if let Some(name) = head
            .trim()
            .rsplit("mod ")
            .next()
            .filter(|_| head.contains("mod "))
            && after[head.len()..].starts_with(';')
        {
            found.push(inside.join(name.trim()).with_extension("rs"));
            found.push(inside.join(name.trim()));
        }
    }
    found
}

/// What is compiled into the product: no comments, nothing from the first unit-test module on.
fn product_text(text: &str) -> String {
    let mut out = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let is_tests = line.trim() == "#[cfg(test)]"
            && lines
                .peek()
                .is_some_and(|next| next.trim_start().starts_with("mod "))
            && lines
                .peek()
                .is_some_and(|next| next.trim_end().ends_with('{'));
        if is_tests {
            break;
        }
        let code = line.split("//").next().unwrap_or_default();
        out.push_str(code);
        out.push('\n');
    }
    out
}

/// `reversal_spike` as the enum has it: `ReversalSpike`.
fn variant(id: &str) -> String {
    let word = |word: &str| word[..1].to_uppercase() + &word[1..];
    id.split('_').map(word).collect()
}

/// Files of the product that name a cause: by its variant, by its name in files, or by its type.
fn files_naming(id: &str, product: &[(PathBuf, String)]) -> Vec<PathBuf> {
    let variant = variant(id);
    let names = [
        format!("Cause::{variant}"),
        format!("\"{id}\""),
        format!("causes::{id}"),
        format!("{id}::{variant}"),
    ];
    let term = format!("term::{id}::{variant}");
    let names_it = |text: &str| {
        let text = text.replace(&term, "");
        names.iter().any(|name| {
            text.match_indices(name).any(|(at, _)| {
                let next = text[at + name.len()..].chars().next();
                !next.is_some_and(|c| c.is_alphanumeric() || c == '_')
            })
        })
    };
    product
        .iter()
        .filter(|(_, text)| names_it(text))
        .map(|(path, _)| path.clone())
        .collect()
}

#[test]
fn a_cause_is_named_in_its_file_and_in_the_list_alone() {
    let root = workspace();
    let mut files = Vec::new();
    for folder in PRODUCT {
        sources(&root.join(folder), &mut files);
    }
    let texts: Vec<(PathBuf, String)> = files
        .into_iter()
        .map(|file| (file.clone(), fs::read_to_string(&file).unwrap()))
        .collect();
    let tests: Vec<PathBuf> = texts
        .iter()
        .flat_map(|(file, text)| only_for_tests(file, text))
        .collect();
    assert!(
        tests.len() > 20,
        "unit tests in files of their own are found"
    );
    let product: Vec<(PathBuf, String)> = texts
        .into_iter()
        .filter(|(file, _)| !tests.iter().any(|test| file.starts_with(test)))
        .map(|(file, text)| {
            let short = file.strip_prefix(&root).unwrap().to_path_buf();
            (short, product_text(&text))
        })
        .collect();
    assert!(product.len() > 250, "{} files", product.len());
    let list = PathBuf::from("host/src/causes/mod.rs");
    for model in ALL {
        let id = model.words().id;
        let own = PathBuf::from(format!("host/src/causes/{id}.rs"));
        let mut naming = files_naming(id, &product);
        naming.sort();
        let mut expected = [own, list.clone()];
        expected.sort();
        assert_eq!(naming, expected, "{id}");
    }
}

#[test]
fn a_cause_has_two_lines_in_the_list_and_a_page() {
    let root = workspace();
    let list = fs::read_to_string(root.join("host/src/causes/mod.rs")).unwrap();
    for model in ALL {
        let id = model.words().id;
        let lines = product_text(&list)
            .lines()
            .filter(|line| {
                line.split(|c: char| !(c.is_alphanumeric() || c == '_'))
                    .any(|word| word == id)
            })
            .count();
        assert_eq!(lines, 2, "{id}: its module and its entry");
        let page = root.join(format!("host/guide/causes/{id}.md"));
        assert!(page.is_file(), "{}", page.display());
    }
}

#[test]
fn names_are_found_where_they_stand_and_not_in_longer_ones() {
    let file = |text: &str| vec![(PathBuf::from("a.rs"), product_text(text))];
    for named in [
        "if cause == Cause::Backlash {}",
        "of(\"backlash\")",
        "use crate::causes::backlash;",
        "    backlash::Backlash,",
    ] {
        assert_eq!(files_naming("backlash", &file(named)).len(), 1, "{named}");
    }
    for other in [
        "Cause::BacklashLike",
        "machine.backlash_m",
        "// Cause::Backlash",
        "#[cfg(test)]\nmod tests {\n    fn f() { Cause::Backlash; }\n}",
    ] {
        assert_eq!(files_naming("backlash", &file(other)).len(), 0, "{other}");
    }
}
