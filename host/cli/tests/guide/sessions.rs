//! Every terminal session that README and guide show, replayed in order, page by page.
//!
//! A page is copied beside the folder of its examples, so that trycmd gives each a directory of its own; blocks of
//! `toml` whose fence names a file (`toml plan.toml`) are put there first. Only times and paths may be left out.
use super::guide;
use std::path::{Path, PathBuf};

fn shown() -> Vec<PathBuf> {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../README.md");
    let all = std::fs::read_dir(guide())
        .unwrap()
        .map(|e| e.unwrap().path())
        .chain([readme]);
    let has = |p: &PathBuf| {
        p.extension().is_some_and(|e| e == "md")
            && std::fs::read_to_string(p).unwrap().contains("```console")
    };
    let mut pages: Vec<PathBuf> = all.filter(has).collect();
    pages.sort();
    pages
}

/// Blocks whose fence is a language and a file name.
fn files(text: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some((_, name)) = line
            .strip_prefix("```")
            .and_then(|fence| fence.split_once(' '))
        else {
            continue;
        };
        let body: Vec<&str> = lines
            .by_ref()
            .take_while(|l| !l.starts_with("```"))
            .collect();
        found.push((name.trim().to_owned(), body.join("\n") + "\n"));
    }
    found
}

#[test]
fn sessions_are_as_shown() {
    let pages = shown();
    assert!(pages.len() >= 2, "{pages:?}");
    let stage = tempfile::tempdir().unwrap();
    let example = guide().join("example");
    for page in &pages {
        let text = std::fs::read_to_string(page).unwrap();
        let place = stage.path().join(page.file_name().unwrap());
        let folder = place.with_extension("in");
        std::fs::create_dir(&folder).unwrap();
        std::fs::create_dir(place.with_extension("out")).unwrap();
        for entry in std::fs::read_dir(&example).unwrap() {
            let from = entry.unwrap().path();
            std::fs::copy(&from, folder.join(from.file_name().unwrap())).unwrap();
        }
        for (name, body) in files(&text) {
            std::fs::write(folder.join(name), body).unwrap();
        }
        std::fs::write(place, text).unwrap();
    }
    let replay = std::panic::catch_unwind(|| {
        trycmd::TestCases::new()
            .register_bin(
                "giotto",
                Path::new(env!("CARGO_BIN_EXE_giotto")).to_path_buf(),
            )
            .env("NO_COLOR", "1")
            .env("COLUMNS", "100")
            .case(stage.path().join("*.md"));
    });
    if std::env::var("TRYCMD").is_ok_and(|v| v == "overwrite") {
        for page in &pages {
            std::fs::copy(stage.path().join(page.file_name().unwrap()), page).unwrap();
        }
    }
    if let Err(panic) = replay {
        std::panic::resume_unwind(panic);
    }
}
