//! Words and numbers of messages.

/// A number of things: `1 point`, `2 points`, `2 vertices`.
pub(crate) fn counted(count: usize, one: &str) -> String {
    match (count, one.strip_suffix("ex")) {
        (1, _) => format!("1 {one}"),
        (_, Some(stem)) => format!("{count} {stem}ices"),
        (_, None) => format!("{count} {one}s"),
    }
}

/// A number as scene files have it: with a point or an exponent.
pub(crate) fn number(value: f32) -> String {
    format!("{value:?}")
}

/// A number with three digits that count.
pub(crate) fn short(value: f64) -> String {
    if value.abs() < 1e-12 || !value.is_finite() {
        return if value.is_finite() {
            "0".to_owned()
        } else {
            format!("{value}")
        };
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A vector as scene files have it.
pub(crate) fn vector([x, y, z]: [f32; 3]) -> String {
    format!("[{x:?}, {y:?}, {z:?}]")
}

/// Text of a user in quotation marks; what cannot be seen is escaped.
pub(crate) fn quoted(text: &str) -> String {
    format!("{text:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_singular() {
        let counts = [(0, "point"), (1, "point"), (2, "point"), (1, "vertex")];
        assert_eq!(
            counts.map(|(count, one)| counted(count, one)),
            ["0 points", "1 point", "2 points", "1 vertex"]
        );
        assert_eq!(counted(3, "vertex"), "3 vertices");
    }

    #[test]
    fn numbers_are_as_in_scene_files() {
        assert_eq!(
            [1.0, 0.25, 1e20].map(number),
            ["1.0", "0.25", "1e20"].map(str::to_owned)
        );
        assert_eq!(vector([0.0, -1.5, 2.0]), "[0.0, -1.5, 2.0]");
        assert_eq!(quoted("a\n\"b\""), r#""a\n\"b\"""#);
    }

    #[test]
    fn short_numbers() {
        let cases = [
            (0.0, "0"),
            (-1e-17, "0"),
            (0.0213, "0.0213"),
            (1.5, "1.5"),
            (12.345, "12.3"),
            (1234.5, "1234"),
            (-0.25, "-0.25"),
            (100.0, "100"),
        ];
        cases
            .iter()
            .for_each(|(value, text)| assert_eq!(short(*value), *text));
    }
}
