//! One line per effect.

use hwall::psychophysics::{Effect, ErrorModel};

/// Factors, degrees of freedom, F, p and size. In strata, degrees of freedom and p of effects with several degrees of
/// freedom are Greenhouse-Geisser corrected, because answers are rarely spherical; pooled errors have no such correction.
pub(super) fn sentence(effect: &Effect) -> String {
    let none = || "none".to_owned();
    let f = effect.f.finite().map_or_else(none, |f| format!("{f:.2}"));
    let correction = match effect.errors {
        ErrorModel::Strata if effect.df1 > 1 => effect.gg.zip(effect.p_gg),
        _ => None,
    };
    let [df1, df2] = [effect.df1, effect.df2].map(|df| match correction {
        Some((epsilon, _)) => format!("{:.2}", epsilon * df as f64),
        None => df.to_string(),
    });
    let (errors, p, plain) = match (effect.errors, correction) {
        (ErrorModel::Pooled, _) => ("pooled error", probability(effect.p), String::new()),
        (_, None) => ("own errors", probability(effect.p), String::new()),
        (_, Some((epsilon, p_gg))) => (
            "own errors",
            probability(Some(p_gg)),
            format!(
                " (Greenhouse and Geisser, epsilon {epsilon:.2}; uncorrected p = {})",
                probability(effect.p)
            ),
        ),
    };
    let size = effect
        .partial_eta2
        .map_or_else(none, |eta2| format!("{eta2:.3}"));
    format!(
        "{} ({errors}): F({df1}, {df2}) = {f}, p = {p}{plain}, partial eta squared {size}",
        effect.name
    )
}

fn probability(p: Option<f64>) -> String {
    match p {
        None => "none".to_owned(),
        Some(p) if p >= 1e-3 => format!("{p:.4}"),
        Some(p) => format!("{p:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall::psychophysics::{Columns, Study, anova};

    /// Regression: reports gave the uncorrected p while warning not to use it.
    #[test]
    fn the_p_of_an_effect_is_the_corrected_one() {
        let mut csv = String::from("subject,a,b,y\n");
        for (subject, answers) in [
            [1.0, 2.0, 9.0, 2.0, 3.0, 5.0],
            [1.5, 2.1, 3.0, 1.0, 3.5, 4.0],
            [0.5, 2.6, 14.0, 2.5, 3.1, 9.0],
            [1.2, 2.2, 6.0, 1.5, 2.0, 8.0],
            [1.1, 2.4, 4.0, 2.2, 3.3, 3.0],
        ]
        .iter()
        .enumerate()
        {
            for (cell, answer) in answers.iter().enumerate() {
                csv += &format!("{subject},{},{},{answer}\n", cell / 3, cell % 3);
            }
        }
        let columns = Columns::new("subject", ["a".to_owned(), "b".to_owned()], "y");
        let study = Study::read_csv(csv.as_bytes(), &columns).unwrap();
        let of = |errors, name: &str| {
            let effects = anova(&study, errors).unwrap();
            effects.into_iter().find(|e| e.name == name).unwrap()
        };
        let b = of(ErrorModel::Strata, "b");
        let (epsilon, p_gg, p) = (b.gg.unwrap(), b.p_gg.unwrap(), b.p.unwrap());
        assert!(epsilon < 0.7 && p_gg > 2.0 * p, "{epsilon} {p_gg} {p}");
        let said = sentence(&b);
        let df = format!("F({:.2}, {:.2})", 2.0 * epsilon, 8.0 * epsilon);
        assert!(said.starts_with("b (own errors): ") && said.contains(&df));
        let first_p = said.split(" = ").nth(2).unwrap();
        let [p_gg, p] = [p_gg, p].map(|p| probability(Some(p)));
        assert!(first_p.starts_with(&format!("{p_gg} (Greenhouse")));
        assert!(said.contains(&format!("uncorrected p = {p})")), "{said}");
        // No correction with one degree of freedom, or for pooled errors.
        assert!(!sentence(&of(ErrorModel::Strata, "a")).contains("Greenhouse"));
        let pooled = sentence(&of(ErrorModel::Pooled, "b"));
        assert!(pooled.starts_with("b (pooled error): F(2, 20)") && !pooled.contains("Greenhouse"));
    }
}
