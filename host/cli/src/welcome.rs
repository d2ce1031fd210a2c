//! What `giotto` alone says: what to do next, from what lies in the directory.
use super::destination::quoted;
use std::path::Path;

const COMMANDS: &str =
    "  giotto demo                      see the whole loop on a simulated machine
  giotto import FILE --help        bring your own measurements in
  giotto analyze CAMPAIGN          what was measured: circles, size, roundness
  giotto diagnose CAMPAIGN         what is wrong, why, and what to do
  giotto flash MODEL --port PORT   write the correction into the controller

giotto --help lists every command.";

/// The words for someone in `folder`.
pub fn words(folder: &Path) -> String {
    format!(
        "giotto finds out why a machine does not draw true circles, and corrects it.\n\n{COMMANDS}\n\nNext: {}",
        next(folder)
    )
}

fn next(folder: &Path) -> String {
    if folder.join("campaign.toml").is_file() {
        return "this directory is a campaign: giotto diagnose .".to_owned();
    }
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| !name.starts_with('.'))
        .collect();
    names.sort();
    if let Some(campaign) = names
        .iter()
        .find(|name| folder.join(name).join("campaign.toml").is_file())
    {
        return format!(
            "{campaign} is a campaign: giotto diagnose {}",
            quoted(campaign)
        );
    }
    let table = |name: &&String| {
        let name = name.to_ascii_lowercase();
        [".csv", ".log"].iter().any(|end| name.ends_with(end))
    };
    match names.iter().find(table) {
        Some(file) => format!(
            "if {file} holds a measured circle: giotto import {} --radius MM --feed MM_S --direction ccw -o campaign",
            quoted(file)
        ),
        None => "giotto demo".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_step_follows_from_what_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        assert_eq!(next(path), "giotto demo");
        std::fs::write(path.join("a ball.CSV"), "").unwrap();
        assert!(
            next(path).contains("giotto import 'a ball.CSV' --radius MM"),
            "{}",
            next(path)
        );
        std::fs::create_dir(path.join("mill")).unwrap();
        std::fs::write(path.join("mill/campaign.toml"), "").unwrap();
        assert!(next(path).ends_with("giotto diagnose mill"));
        assert_eq!(
            next(&path.join("mill")),
            "this directory is a campaign: giotto diagnose ."
        );
        assert_eq!(next(&path.join("nowhere")), "giotto demo");
    }
}
