//! Covering arrays: few rows of choices in which every two that may meet do (Cohen et al. 1997,
//! greedy).

use std::collections::BTreeSet;

use super::Random;

/// The factor, and which of its values.
pub type Choice = (usize, usize);

/// Rows of choices, at most one of each factor, such that any two choices of different factors
/// stand together in a row; and the pairs that may not. `counts` are the numbers of values;
/// `is_legal` says whether some choices may stand together where all other factors are as they
/// come.
pub fn covering_rows(
    counts: &[usize],
    is_legal: impl Fn(&[Choice]) -> bool,
) -> (Vec<Vec<Choice>>, Vec<[Choice; 2]>) {
    let choices: Vec<Choice> = (0..counts.len())
        .flat_map(|factor| (0..counts[factor]).map(move |value| (factor, value)))
        .collect();
    let mut open: BTreeSet<[Choice; 2]> = BTreeSet::new();
    for (i, a) in choices.iter().enumerate() {
        open.extend(
            choices[i + 1..]
                .iter()
                .filter(|b| a.0 != b.0)
                .map(|b| [*a, *b]),
        );
    }
    let mut random = Random::new(1997);
    let (mut rows, mut refused) = (Vec::new(), Vec::new());
    while let Some(pair) = open.pop_first() {
        // What two choices may not, they may with a third.
        let thirds = choices
            .iter()
            .map(|third| [pair[0], pair[1], *third])
            .filter(|row| row[2].0 != row[0].0 && row[2].0 != row[1].0);
        let Some(mut row) = std::iter::once(pair.to_vec())
            .chain(thirds.map(|row| row.to_vec()))
            .find(|row| is_legal(row))
        else {
            refused.push(pair);
            continue;
        };
        let mut factors: Vec<usize> = (0..counts.len())
            .filter(|factor| row.iter().all(|choice| choice.0 != *factor))
            .collect();
        for i in (1..factors.len()).rev() {
            factors.swap(i, random.below(i as u32 + 1) as usize);
        }
        for factor in factors {
            let gain = |choice: Choice| {
                row.iter()
                    .filter(|chosen| open.contains(&sorted(choice, **chosen)))
                    .count()
            };
            let mut values: Vec<(usize, u32, Choice)> = (0..counts[factor])
                .map(|value| (gain((factor, value)), random.next_u32(), (factor, value)))
                .collect();
            values.sort_by(|a, b| b.cmp(a));
            let fits = values
                .into_iter()
                .find(|(_, _, choice)| is_legal(&[row.as_slice(), &[*choice]].concat()));
            row.extend(fits.map(|(_, _, choice)| choice));
        }
        for (i, a) in row.iter().enumerate() {
            open.retain(|pair| !row[i + 1..].iter().any(|b| *pair == sorted(*a, *b)));
        }
        rows.push(row);
    }
    (rows, refused)
}

fn sorted(a: Choice, b: Choice) -> [Choice; 2] {
    if a < b { [a, b] } else { [b, a] }
}
