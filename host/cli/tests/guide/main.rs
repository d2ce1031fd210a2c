//! The guide holds what it says: words, bytes, links and terminal sessions.
//!
//! Blocks between `<!-- name -->` and `<!-- end -->` are written by the code: after a change,
//! `GIOTTO_BLESS=1 cargo test -p giotto-cli --test guide` writes them anew, and the difference is read before it is
//! committed. Sessions likewise with `TRYCMD=overwrite`.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may fail where it stands"
)]
mod bytes;
mod links;
mod sessions;
mod words;

use std::path::{Path, PathBuf};

/// The folder of the guide.
fn guide() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../guide")
}

/// The text between `<!-- name -->` and `<!-- end -->` of a page has to be `expected`.
fn holds(page: &str, name: &str, expected: &str) {
    let path = guide().join(page);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{page}: {e}"));
    let begin = format!("<!-- {name} -->\n");
    let from = text
        .find(&begin)
        .unwrap_or_else(|| panic!("{page}: no block `{name}`"))
        + begin.len();
    let to = from
        + text[from..]
            .find("<!-- end -->")
            .unwrap_or_else(|| panic!("{page}: `{name}` has no end"));
    let expected = format!("{}\n", expected.trim_end());
    if text[from..to] == expected {
        return;
    }
    if std::env::var_os("GIOTTO_BLESS").is_some() {
        std::fs::write(&path, format!("{}{expected}{}", &text[..from], &text[to..])).unwrap();
        return;
    }
    panic!(
        "{page}: `{name}` is not what the code says. To write it anew: GIOTTO_BLESS=1 cargo test -p giotto-cli --test guide\n\
         page:\n{}\ncode:\n{expected}",
        &text[from..to]
    );
}
