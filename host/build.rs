//! The guide (`guide/*.md`, links as for a book) as documentation of the crate: each page a module, its links
//! to other pages turned into links between modules. Only `cargo doc` reads what is written here.
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=guide");
    println!("cargo::rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("no OUT_DIR"))?);
    let pages = fs::canonicalize("guide").and_then(|folder| read(&folder, &folder));
    // A package without its guide still builds.
    let pages = pages.unwrap_or_default();
    let mut modules = String::new();
    let mut folder: Option<String> = None;
    for (name, text) in &pages {
        let file = out.join(format!("{}.md", name.replace('/', ".")));
        fs::write(&file, relinked(name, text))?;
        let doc = format!("#[doc = include_str!({file:?})]");
        // Writing to a String cannot fail.
        let _ = match name.split_once('/') {
            _ if name == "index" => Ok(()),
            None => {
                let close = if folder.take().is_some() { "}\n" } else { "" };
                let nested = pages
                    .keys()
                    .any(|other| other.starts_with(&format!("{name}/")));
                if nested {
                    folder = Some(name.clone());
                }
                writeln!(
                    modules,
                    "{close}{doc}\npub mod {} {}",
                    module(name),
                    if nested { "{" } else { "{}" }
                )
            }
            Some((_, page)) => writeln!(modules, "{doc}\npub mod {} {{}}", module(page)),
        };
    }
    if folder.is_some() {
        modules += "}\n";
    }
    let index = out.join("index.md");
    let text = if pages.is_empty() {
        String::new()
    } else {
        format!("#[doc = include_str!({index:?})]\npub mod guide {{\n{modules}}}\n")
    };
    fs::write(out.join("guide.rs"), text)
}

fn module(page: &str) -> String {
    page.replace('-', "_")
}

/// Pages by path without extension, sorted so that a folder follows the page of its name.
fn read(root: &Path, folder: &Path) -> io::Result<BTreeMap<String, String>> {
    let mut pages = BTreeMap::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            pages.extend(read(root, &path)?);
        } else if path.extension().is_some_and(|e| e == "md") && !path.ends_with("SUMMARY.md") {
            let name = path.with_extension("");
            let name = name
                .strip_prefix(root)
                .map_err(io::Error::other)?
                .to_string_lossy()
                .replace('\\', "/");
            pages.insert(name, fs::read_to_string(&path)?);
        }
    }
    Ok(pages)
}

/// `[x](page.md#part)` → `[x](../page/index.html#part)`, as the pages lie in the documentation.
fn relinked(name: &str, text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("](") {
        let (before, after) = rest.split_at(at + 2);
        out += before;
        let Some(end) = after.find(')') else { break };
        let link = &after[..end];
        let (path, anchor) = link
            .split_once('#')
            .map_or((link, String::new()), |(p, a)| (p, format!("#{a}")));
        match path.strip_suffix(".md").filter(|p| !p.contains("://")) {
            Some(page) => out += &format!("{}{anchor}", address(name, page)),
            // A file beside the guide has no place in the documentation: its name stays, the link goes.
            None if !link.contains("://") && !path.is_empty() => {
                out.truncate(out.len() - 2);
                if let Some(open) = out.rfind('[') {
                    out.remove(open);
                }
                rest = &after[end + 1..];
                continue;
            }
            None => out += link,
        }
        rest = &after[end..];
    }
    out + rest
}

/// Where `page`, as `name` links to it, lies from the module of `name`.
fn address(name: &str, page: &str) -> String {
    let mut parts: Vec<&str> = name.split('/').collect();
    parts.pop();
    for part in page.split('/') {
        match part {
            ".." => drop(parts.pop()),
            "." => {}
            part => parts.push(part),
        }
    }
    // Every page but the first is a folder of its own.
    let up = if name == "index" {
        0
    } else {
        name.split('/').count()
    };
    let target = if parts == ["index"] {
        String::new()
    } else {
        module(&parts.join("/")) + "/"
    };
    "../".repeat(up) + &target + "index.html"
}
