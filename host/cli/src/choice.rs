//! Choices of the library as values of an option.
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// Reads one of `all`: value, name, what it is.
pub fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [(T, &'static str, &'static str); N],
) -> impl TypedValueParser<Value = T> {
    let values = all.map(|(_, name, what)| PossibleValue::new(name).help(what));
    PossibleValuesParser::new(values).try_map(move |given| {
        let chosen = all.iter().find(|(_, name, _)| *name == given);
        chosen
            .map(|(value, ..)| *value)
            .ok_or("not one of the choices")
    })
}

/// A whole number.
///
/// # Errors
/// Anything else, or more than the option holds.
pub fn whole<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse()
        .map_err(|_| "expected a whole number, 0 or more".to_owned())
}

/// Runs of a plan.
pub fn up_to_60(text: &str) -> Result<u8, String> {
    match text.parse() {
        Ok(count @ 1..=60) => Ok(count),
        _ => Err("expected 1 to 60".to_owned()),
    }
}
