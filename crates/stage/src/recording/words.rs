//! Conversion of option values to text and back.

use anyhow::Context;
use clap::ValueEnum;

pub(super) fn wanted<'a>(value: Option<&'a str>, key: &str) -> anyhow::Result<&'a str> {
    value.with_context(|| format!("the recording does not say its {key}: not one of the main job"))
}

/// The word of the command line.
pub(crate) fn name_of(value: impl ValueEnum) -> String {
    let word = value.to_possible_value();
    word.map_or_else(String::new, |word| word.get_name().to_owned())
}

pub(super) fn flag_of(key: &str, text: &str) -> anyhow::Result<bool> {
    let flag = text.parse();
    flag.with_context(|| format!("{key}: {text:?} is neither true nor false"))
}

pub(super) fn named<T: ValueEnum>(key: &str, text: &str) -> anyhow::Result<T> {
    T::from_str(text, false).map_err(|_| anyhow::anyhow!("{key}: {text:?} is not known"))
}

pub(super) fn numbers(values: &[f64]) -> String {
    let words: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
    words.join(" ")
}

pub(super) fn numbers_of<const N: usize>(key: &str, text: &str) -> anyhow::Result<[f64; N]> {
    let parsed = text.split_whitespace().map(|word| {
        let value: f64 = word
            .parse()
            .with_context(|| format!("{key}: {word:?} is no number"))?;
        anyhow::ensure!(value.is_finite(), "{key}: {word} is not finite");
        Ok(value)
    });
    let values: Vec<f64> = parsed.collect::<anyhow::Result<_>>()?;
    let count = values.len();
    let all = <[f64; N]>::try_from(values);
    all.map_err(|_| anyhow::anyhow!("{key}: {count} numbers instead of {N}"))
}
