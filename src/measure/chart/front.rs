//! The Pareto front: what nothing else beats in cost and error at once.

use crate::graph::Spread;

/// What one point costs, and how wrong it is; less is better in both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Price {
    /// Cost, with its spread over the runs.
    pub cost: Spread,
    /// How wrong it is, relative to the mean of the reference.
    pub error: f64,
}

/// Indices of the points that no other one beats, cheapest first: a point is beaten by one that is
/// no worse in either and better in one, by medians. If points are equal, the first is taken.
pub fn front(prices: &[Price]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..prices.len()).collect();
    order.sort_by(|&a, &b| {
        prices[a]
            .cost
            .median
            .total_cmp(&prices[b].cost.median)
            .then(prices[a].error.total_cmp(&prices[b].error))
    });
    let mut least = f64::INFINITY;
    order.retain(|&index| {
        let is_better = prices[index].error < least;
        least = least.min(prices[index].error);
        is_better
    });
    order
}

/// Whether each point is on the front within the spread of its cost: none beats it even if this one
/// had always cost its least and the other one its most. The front of a second run lies among these
/// if its medians are within the spread of the first.
pub fn near_front(prices: &[Price]) -> Vec<bool> {
    let beats = |other: &Price, price: &Price| {
        let (most, least) = (other.cost.max, price.cost.min);
        (most < least && other.error <= price.error) || (most <= least && other.error < price.error)
    };
    prices
        .iter()
        .map(|price| !prices.iter().any(|other| beats(other, price)))
        .collect()
}

/// The points of the [`front`] that differ for certain, cheapest first. The error of each is lower
/// than that of the point before by more than `noise`. Its fastest run still costs more than the
/// slowest run of the point before. If two do not differ in error, the cheaper one is taken; if two
/// do not differ in cost, the better one.
pub fn distinct_front(prices: &[Price], noise: f64) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for index in front(prices) {
        let price = &prices[index];
        if kept
            .last()
            .is_some_and(|&last| prices[last].error - price.error <= noise)
        {
            continue;
        }
        while kept
            .last()
            .is_some_and(|&last| prices[last].cost.max > price.cost.min)
        {
            kept.pop();
        }
        kept.push(index);
    }
    kept
}

/// The cheapest point with an error of at most `bound`; of equally cheap ones that with the least
/// of `other`, which is what else it costs.
pub fn cheapest(prices: &[Price], bound: f64, other: impl Fn(usize) -> f64) -> Option<usize> {
    let order = |a: &usize, b: &usize| {
        prices[*a]
            .cost
            .median
            .total_cmp(&prices[*b].cost.median)
            .then(other(*a).total_cmp(&other(*b)))
    };
    (0..prices.len())
        .filter(|&index| prices[index].error <= bound)
        .min_by(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn price(cost: f64, spread: f64, error: f64) -> Price {
        Price {
            cost: Spread {
                median: cost,
                min: cost - spread,
                max: cost + spread,
                n: 3,
            },
            error,
        }
    }

    /// Planted: 0, 3 and 5 are the front; 1 is beaten by 0, 2 by 3, 4 has the error of 3 for more,
    /// 6 is 5 again.
    #[test]
    fn the_front_is_what_nothing_beats() {
        let prices = [
            (1.0, 0.9),
            (2.0, 0.95),
            (4.0, 0.5),
            (3.0, 0.4),
            (5.0, 0.4),
            (9.0, 0.1),
            (9.0, 0.1),
        ]
        .map(|(cost, error)| price(cost, 0.0, error));
        assert_eq!(front(&prices), [0, 3, 5]);
        assert_eq!(front(&[]), [0; 0]);
    }

    /// A pass that is slowed puts its point off the front.
    #[test]
    fn a_slower_point_leaves_the_front() {
        let at = |cost| {
            [
                price(1.0, 0.0, 0.5),
                price(cost, 0.0, 0.3),
                price(3.0, 0.0, 0.2),
            ]
        };
        assert_eq!(front(&at(2.0)), [0, 1, 2]);
        assert_eq!(front(&at(102.0)), [0, 2]);
    }

    /// Every point of the front is near it; another one is if its runs overlap with those of all
    /// that beat it. Costs without spread decide by themselves.
    #[test]
    fn spread_decides_what_is_near() {
        let prices = [
            price(1.0, 0.1, 0.5),
            price(1.2, 0.15, 0.6),
            price(2.0, 0.1, 0.6),
            price(2.1, 0.1, 0.5),
        ];
        assert_eq!(front(&prices), [0]);
        assert_eq!(near_front(&prices), [true, true, false, false]);
        let bytes = [(8.0, 0.2), (8.0, 0.3), (9.0, 0.2), (9.0, 0.1)]
            .map(|(cost, error)| price(cost, 0.0, error));
        assert_eq!(near_front(&bytes), [true, false, false, true]);
    }

    #[test]
    fn the_cheapest_meets_the_bound() {
        let prices = [(5.0, 0.04), (3.0, 0.09), (1.0, 0.5), (4.0, 0.05)]
            .map(|(cost, error)| price(cost, 0.0, error));
        assert_eq!(
            [0.01, 0.05, 0.1, 1.0].map(|bound| cheapest(&prices, bound, |_| 0.0)),
            [None, Some(3), Some(1), Some(2)]
        );
    }

    /// Three settings of one structure have the same bytes: the fastest is taken, although it is
    /// the worst of them.
    #[test]
    fn time_decides_among_equal_bytes() {
        let prices = [(8.0, 0.02), (8.0, 0.03), (8.0, 0.04), (9.0, 0.01)]
            .map(|(bytes, error)| price(bytes, 0.0, error));
        assert_eq!(
            cheapest(&prices, 0.05, |index| [450.0, 150.0, 60.0, 1.0][index]),
            Some(2)
        );
        assert_eq!(
            cheapest(&prices, 0.03, |index| [450.0, 150.0, 60.0, 1.0][index]),
            Some(1)
        );
    }

    /// Planted: 1 is better than 0 by less than the noise, 2 by more; 3 costs what 2 costs, within
    /// the spread, and is better by more than the noise.
    #[test]
    fn what_differs_by_less_than_the_noise_is_one() {
        let prices = [
            price(1.0, 0.1, 0.30),
            price(2.0, 0.1, 0.295),
            price(3.0, 0.1, 0.20),
            price(3.15, 0.1, 0.10),
            price(9.0, 0.1, 0.095),
        ];
        assert_eq!(front(&prices), [0, 1, 2, 3, 4]);
        assert_eq!(distinct_front(&prices, 0.01), [0, 3]);
        assert_eq!(distinct_front(&prices, 0.004), [0, 1, 3, 4]);
        let certain = prices.map(|price| Price {
            cost: Spread {
                min: price.cost.median,
                max: price.cost.median,
                ..price.cost
            },
            ..price
        });
        assert_eq!(distinct_front(&certain, 0.0), [0, 1, 2, 3, 4]);
        assert_eq!(distinct_front(&[], 0.01), [0; 0]);
    }
}
