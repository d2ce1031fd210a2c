//! Links between pages, and what a page must have to be read as documentation and as a book.
use super::guide;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn pages() -> Vec<PathBuf> {
    let folders = [guide(), guide().join("causes")];
    let all = folders
        .iter()
        .flat_map(|f| std::fs::read_dir(f).unwrap())
        .map(|e| e.unwrap().path());
    let mut pages: Vec<PathBuf> = all
        .filter(|p| p.extension().is_some_and(|e| e == "md"))
        .collect();
    pages.sort();
    pages
}

/// A page without its fenced blocks.
fn prose(text: &str) -> String {
    let mut inside = false;
    let kept = text.lines().filter(|line| {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        !inside && !fence
    });
    kept.collect::<Vec<_>>().join("\n")
}

/// Anchors of the headings, as they are made by GitHub, mdBook and rustdoc alike: letters, digits, hyphens.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = prose(text);
    let headings = headings.lines().filter_map(|l| {
        l.trim_start_matches('#')
            .strip_prefix(' ')
            .filter(|_| l.starts_with('#'))
    });
    let kept = |c: char| c.is_alphanumeric() || c == '-' || c == '_' || c == ' ';
    headings
        .map(|h| {
            h.to_lowercase()
                .chars()
                .filter(|c| kept(*c))
                .collect::<String>()
                .replace(' ', "-")
        })
        .collect()
}

fn links(text: &str) -> Vec<String> {
    let text = prose(text);
    text.split("](")
        .skip(1)
        .filter_map(|rest| Some(rest.split_once(')')?.0.to_owned()))
        .collect()
}

/// What is wrong with the links of a page.
fn broken(page: &Path, text: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    for link in links(text).iter().filter(|l| !l.contains("://")) {
        let (path, anchor) = link
            .split_once('#')
            .map_or((link.as_str(), None), |(p, a)| (p, Some(a)));
        let target = if path.is_empty() {
            page.to_path_buf()
        } else {
            page.parent().unwrap().join(path)
        };
        match std::fs::read_to_string(&target) {
            Ok(text) if anchor.is_none_or(|a| anchors(&text).contains(a)) => {}
            Ok(_) => wrong.push(format!("{}: no such heading: {link}", page.display())),
            // A folder or a file that is no text may be linked to as a whole.
            Err(_) if target.exists() && anchor.is_none() => {}
            Err(_) => wrong.push(format!("{}: no such file: {link}", page.display())),
        }
    }
    wrong
}

#[test]
fn every_link_leads_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let others = ["README.md", "CHANGELOG.md"].map(|name| root.join(name));
    let mut count = 0;
    for page in pages().iter().chain(&others) {
        let text = std::fs::read_to_string(page).unwrap();
        count += links(&text).len();
        assert_eq!(broken(page, &text), Vec::<String>::new());
    }
    assert!(count > 60, "{count} links were found");
    // The check sees what is wrong.
    let page = guide().join("index.md");
    assert_eq!(
        broken(
            &page,
            "[a](nowhere.md) [b](figures.md#nothing) [c](figures.md#one-run)"
        )
        .len(),
        2
    );
}

#[test]
fn the_summary_lists_every_page_once() {
    let text = std::fs::read_to_string(guide().join("SUMMARY.md")).unwrap();
    let mut listed = links(&text);
    listed.sort();
    let mut there: Vec<String> = pages()
        .iter()
        .map(|p| {
            p.strip_prefix(guide())
                .unwrap()
                .to_string_lossy()
                .replace('\\', "/")
        })
        .filter(|p| p != "SUMMARY.md")
        .collect();
    there.sort();
    assert_eq!(listed, there);
}

/// A fence without a language would be compiled as Rust by the documentation.
#[test]
fn every_fence_names_its_language() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let fences: Vec<&str> = text
            .lines()
            .filter(|l| l.trim_start().starts_with("```"))
            .collect();
        for (k, fence) in fences.iter().enumerate() {
            assert_eq!(
                fence.trim().len() > 3,
                k % 2 == 0,
                "{}: {fence}",
                page.display()
            );
        }
        assert_eq!(fences.len() % 2, 0, "{}", page.display());
    }
}
