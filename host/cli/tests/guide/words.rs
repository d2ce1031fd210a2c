//! A page a cause, with the words that the diagnosis uses.
use super::holds;
use giotto::causes::{ALL, CauseModel, Seat};

fn block(model: &dyn CauseModel) -> String {
    let words = model.words();
    let axis = match model.seat() {
        Seat::Machine => "the machine as a whole",
        Seat::One => "x, y or z",
        Seat::MachineOrOne => "the machine as a whole, or x, y or z",
        Seat::Pair => "x and y, y and z, or z and x",
        Seat::Across => "x, y or z, and the one that shifts",
        Seat::Joint => "a joint",
        Seat::MachineOrJoint => {
            "a joint where the kinematics are known, else the machine as a whole"
        }
        Seat::PairOrJoint => "x and y, y and z, or z and x; a joint where the kinematics are known",
    };
    let corrected = words
        .not_compensable
        .map_or_else(|| "yes".to_owned(), |why| format!("no: {why}"));
    let sentence = |text: &str| {
        let mut letters = text.chars();
        letters.next().map_or_else(String::new, |first| {
            format!("{}{}.", first.to_uppercase(), letters.as_str())
        })
    };
    let alike = match words.never_told_from {
        [] => String::new(),
        names => format!(
            "| circles never tell it from | {} |\n",
            names.join(", ").replace('_', " ")
        ),
    };
    format!(
        "{}\n\n| | |\n|---|---|\n| name in files | `{}` |\n| estimate | {} |\n| axis | {axis} |\n| usually | {} |\n| remedy | {} |\n\
         | to make sure | {} |\n{alike}| corrected by the controller | {corrected} |",
        sentence(words.what),
        words.id,
        words.unit,
        words.usual,
        words.adjust,
        words.next
    )
}

#[test]
fn each_cause_has_its_page() {
    let mut list =
        String::from("| cause | estimate | what it is | corrected |\n|---|---|---|---|\n");
    for &model in ALL {
        let words = model.words();
        holds(&format!("causes/{}.md", words.id), "words", &block(model));
        let corrected = if words.not_compensable.is_none() {
            "yes"
        } else {
            "no"
        };
        list += &format!(
            "| [`{0}`](causes/{0}.md) | {1} | {2} | {corrected} |\n",
            words.id, words.unit, words.what
        );
    }
    holds("causes.md", "list", &list);
    // No page without a cause.
    let pages = std::fs::read_dir(super::guide().join("causes"))
        .unwrap()
        .count();
    assert_eq!(pages, ALL.len());
}
