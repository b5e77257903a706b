//! Settings that must be refused, and the name that the refusal must give.

/// Each of these values alone, in otherwise good settings, must be refused by a message that begins with the last name of the field, or with the words
/// after `=>`.
///
/// ```
/// use hwall_testkit::refused;
///
/// #[derive(Clone)]
/// struct Config {
///     period_s: f64,
/// }
/// let checked = |config: Config| match config.period_s > 0.0 {
///     true => Ok(config),
///     false => Err("period_s must be positive"),
/// };
/// refused!(Config { period_s: 1.0 }, checked, {
///     period_s = 0.0, -1.0, f64::NAN;
///     period_s = f64::NEG_INFINITY => "period_s must";
/// });
/// ```
#[macro_export]
macro_rules! refused {
    ($good:expr, $make:expr, { $($($field:ident).+ = $($value:expr),+ $(=> $named:literal)?;)+ }) => {{
        let (good, mut make) = ($good, $make);
        $({
            let row = concat!(stringify!($($field).+), " = ", stringify!($($value),+));
            let words: &[&str] = &[$($named)?];
            let field = [$(stringify!($field)),+];
            let named = words.first().unwrap_or(&field[field.len() - 1]);
            for value in [$($value),+] {
                let mut spoiled = good.clone();
                spoiled.$($field).+ = value;
                let refusal = make(spoiled).err();
                let said = refusal.unwrap_or_else(|| panic!("{row}: taken")).to_string();
                assert!(said.starts_with(named), "{row}: {said}");
            }
        })+
    }};
}

/// What an error says.
///
/// # Panics
/// Without an error.
#[track_caller]
pub fn refusal<T, E: std::fmt::Display>(result: Result<T, E>) -> String {
    match result {
        Ok(_) => panic!("taken"),
        Err(error) => error.to_string(),
    }
}
