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
