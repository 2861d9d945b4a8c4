//! From a grid's values to what they look like: linear between nodes.

use crate::geometry::grid::Range;

/// What a value looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferNode {
    /// The value of the grid.
    pub value: f64,
    /// Radiance of an opaque body of this value; what is given off is this times the extinction.
    pub color: [f64; 3],
    /// Extinction coefficient σ, 1/m, ≥ 0.
    pub extinction: f64,
}

/// Colour and extinction by value, linear between nodes; before the first and after the last as they are
/// there. Two nodes of one value make a step.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    nodes: Vec<TransferNode>,
    /// Between neighbouring nodes, and beyond the first and the last.
    spans: Vec<TransferSpan>,
    brightest: f64,
}

/// A part of the function in which it is linear: a + b·value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TransferSpan {
    pub(super) extinction: [f64; 2],
    pub(super) color: [[f64; 2]; 3],
}

/// Why a list of nodes is no transfer function.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TransferError {
    /// There are none.
    #[error("a transfer function needs at least one node")]
    Empty,
    /// Their values do not ascend.
    #[error("the values of a transfer function must ascend: {value} follows {before}")]
    Order {
        /// The value.
        value: f64,
        /// The one before it.
        before: f64,
    },
    /// A number is not finite, or negative where it must not be.
    #[error(
        "node {index} (counted from 0) of a transfer function must be finite, its color and extinction not negative"
    )]
    Number {
        /// The node.
        index: usize,
    },
}

impl TransferFunction {
    /// The function through `nodes`.
    ///
    /// # Errors
    /// [`TransferError`] where there are none, their values do not ascend, or numbers are no amounts.
    pub fn new(nodes: Vec<TransferNode>) -> Result<Self, TransferError> {
        let (Some(&first), Some(&last)) = (nodes.first(), nodes.last()) else {
            return Err(TransferError::Empty);
        };
        let is_amount = |x: f64| x.is_finite() && x >= 0.0;
        let is_sound = |n: &TransferNode| {
            n.value.is_finite() && is_amount(n.extinction) && n.color.into_iter().all(is_amount)
        };
        if let Some(index) = nodes.iter().position(|n| !is_sound(n)) {
            return Err(TransferError::Number { index });
        }
        if let Some(pair) = nodes.windows(2).find(|pair| pair[1].value < pair[0].value) {
            return Err(TransferError::Order { value: pair[1].value, before: pair[0].value });
        }
        let constant = |n: TransferNode| TransferSpan {
            extinction: [n.extinction, 0.0],
            color: n.color.map(|c| [c, 0.0]),
        };
        let mut spans = vec![constant(first)];
        spans.extend(nodes.windows(2).map(|pair| TransferSpan::between(&pair[0], &pair[1])));
        spans.push(constant(last));
        let colors = nodes.iter().flat_map(|n| n.color);
        let brightest = colors.fold(0.0, f64::max);
        Ok(Self { nodes, spans, brightest })
    }

    /// Colour and extinction of a value. At a step, those above it.
    pub fn at(&self, value: f64) -> ([f64; 3], f64) {
        let span = self.span(value);
        (span.color.map(|[a, b]| a + b * value), span.extinction[0] + span.extinction[1] * value)
    }

    /// The greatest component of a colour.
    pub(super) fn brightest(&self) -> f64 {
        self.brightest
    }

    /// The part that holds a value.
    #[inline]
    pub(super) fn span(&self, value: f64) -> &TransferSpan {
        &self.spans[self.nodes.partition_point(|n| n.value <= value)]
    }

    /// The values between `lo` and `hi` at which the function bends.
    #[inline]
    pub(super) fn bends(&self, lo: f64, hi: f64) -> impl Iterator<Item = f64> {
        let first = self.nodes.partition_point(|n| n.value <= lo);
        self.nodes[first..].iter().map(|n| n.value).take_while(move |&v| v < hi)
    }

    /// Whether no value of a range absorbs or glows.
    #[inline]
    pub(super) fn is_clear(&self, range: Range) -> bool {
        let (lo, hi) = (f64::from(range.min), f64::from(range.max));
        // Extinctions are not negative and linear between nodes: zero where they are so at both ends.
        let clear_at = |value: f64, span: &TransferSpan| {
            let [a, b] = span.extinction;
            a == 0.0 && b == 0.0 || a + b * value <= 0.0
        };
        let first = self.nodes.partition_point(|n| n.value <= lo);
        let last = self.nodes.partition_point(|n| n.value <= hi);
        clear_at(lo, &self.spans[first])
            && clear_at(hi, &self.spans[last])
            && self.nodes[first..last].iter().all(|n| n.extinction == 0.0)
    }
}

impl TransferSpan {
    fn between(from: &TransferNode, to: &TransferNode) -> Self {
        let width = to.value - from.value;
        let line = |a: f64, b: f64| {
            // No value lies within a step.
            let slope = if width > 0.0 { (b - a) / width } else { 0.0 };
            if slope.is_finite() { [a - slope * from.value, slope] } else { [a, 0.0] }
        };
        Self {
            extinction: line(from.extinction, to.extinction),
            color: std::array::from_fn(|i| line(from.color[i], to.color[i])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(value: f64, color: f64, extinction: f64) -> TransferNode {
        TransferNode { value, color: [color; 3], extinction }
    }

    #[test]
    fn linear_between_nodes_with_a_step() {
        let f = TransferFunction::new(vec![
            node(1.0, 0.0, 0.0),
            node(3.0, 4.0, 2.0),
            node(3.0, 1.0, 0.0),
            node(5.0, 1.0, 0.0),
            node(6.0, 1.0, 8.0),
        ])
        .unwrap();
        let at = |value: f64| (f.at(value).0[0], f.at(value).1);
        assert_eq!([at(-9.0), at(1.0), at(2.0)], [(0.0, 0.0), (0.0, 0.0), (2.0, 1.0)]);
        assert_eq!([at(3.0), at(5.5), at(60.0)], [(1.0, 0.0), (1.0, 4.0), (1.0, 8.0)]);
        assert_eq!(f.bends(1.0, 5.5).collect::<Vec<_>>(), [3.0, 3.0, 5.0]);
        let clear = |min: f32, max: f32| f.is_clear(Range { min, max });
        assert!(clear(-3.0, 1.0) && clear(3.0, 5.0) && clear(4.0, 4.0));
        assert!(!clear(0.0, 1.1) && !clear(4.0, 5.1) && !clear(0.0, 4.0) && !clear(9.0, 9.0));
        assert!(!clear(2.9, 3.0));
    }

    #[test]
    fn mistakes_are_told() {
        assert_eq!(TransferFunction::new(vec![]), Err(TransferError::Empty));
        let order = TransferFunction::new(vec![node(2.0, 0.0, 0.0), node(1.0, 0.0, 0.0)]);
        assert_eq!(order, Err(TransferError::Order { value: 1.0, before: 2.0 }));
        let number = TransferFunction::new(vec![node(2.0, 0.0, -1.0)]);
        assert_eq!(number, Err(TransferError::Number { index: 0 }));
    }
}
