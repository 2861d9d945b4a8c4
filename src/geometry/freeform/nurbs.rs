//! NURBS surfaces: checked, and cut into Bézier patches.
//!
//! Sources: Piegl and Tiller, *The NURBS Book*, §4.4; Ramshaw, *Blossoming*, for the control points of
//! the pieces.

use glam::{DVec2, DVec3, DVec4};

use super::bezier::{BezierPatch, MAX_DEGREE};

/// A non-uniform rational B-spline surface.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsSurface {
    degree: [usize; 2],
    knots: [Vec<f64>; 2],
    /// Control points along u and along v.
    count: [usize; 2],
    /// Homogeneous, those along u next to each other.
    control: Vec<DVec4>,
}

/// Names of the directions.
const DIRECTIONS: [&str; 2] = ["u", "v"];

/// What is wrong with a surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NurbsError {
    /// A degree is out of range.
    #[error("the degree along {along} must be from 1 to {MAX_DEGREE}, not {degree}")]
    Degree {
        /// "u" or "v".
        along: &'static str,
        /// What it is.
        degree: usize,
    },
    /// Too few control points for the degree.
    #[error("degree {degree} along {along} takes at least {} control points, not {count}", .degree + 1)]
    Control {
        /// "u" or "v".
        along: &'static str,
        /// The degree.
        degree: usize,
        /// How many there are.
        count: usize,
    },
    /// The number of knots does not fit.
    #[error(
        "`knots_{along}` must have {} numbers, for {count} control points of degree {degree}, not {knots}",
        .count + .degree + 1
    )]
    KnotCount {
        /// "u" or "v".
        along: &'static str,
        /// Control points.
        count: usize,
        /// The degree.
        degree: usize,
        /// How many knots there are.
        knots: usize,
    },
    /// Knots go back.
    #[error("`knots_{along}` must not decrease, as number {at} (the first is 0) does")]
    KnotOrder {
        /// "u" or "v".
        along: &'static str,
        /// Index of the first that is less than the one before.
        at: usize,
    },
    /// A knot stands too often.
    #[error("`knots_{along}` has {knot} more than {} times, for degree {degree}", .degree + 1)]
    KnotMultiplicity {
        /// "u" or "v".
        along: &'static str,
        /// The knot.
        knot: f64,
        /// The degree.
        degree: usize,
    },
    /// The knots leave no interval.
    #[error("`knots_{along}` are all the same where the surface is")]
    KnotDomain {
        /// "u" or "v".
        along: &'static str,
    },
    /// Weights and control points do not match.
    #[error("there must be one weight for each of the {points} control points, not {weights}")]
    WeightCount {
        /// Control points.
        points: usize,
        /// Weights.
        weights: usize,
    },
    /// A weight is not above 0.
    #[error("weights must be above 0, unlike number {at} (the first is 0), {weight}")]
    Weight {
        /// Its index.
        at: usize,
        /// What it is.
        weight: f64,
    },
    /// A number is NaN or infinite.
    #[error("control points, weights and knots must be finite")]
    NotFinite,
}

impl NurbsSurface {
    /// A surface of `count[0]` × `count[1]` control points, those along u next to each other. It is
    /// defined where all basis functions are: from knot number p to the p + 1st from the end. Without
    /// weights all are 1.
    ///
    /// # Errors
    /// [`NurbsError`], the first that is found.
    pub fn new(
        degree: [usize; 2],
        knots: [Vec<f64>; 2],
        count: [usize; 2],
        points: &[DVec3],
        weights: Option<&[f64]>,
    ) -> Result<Self, NurbsError> {
        for (i, along) in DIRECTIONS.into_iter().enumerate() {
            check_knots(along, degree[i], count[i], &knots[i])?;
        }
        assert_eq!(points.len(), count[0] * count[1], "a grid of points");
        let ones;
        let weights = match weights {
            Some(weights) => weights,
            None => {
                ones = vec![1.0; points.len()];
                &ones
            }
        };
        if weights.len() != points.len() {
            let (points, weights) = (points.len(), weights.len());
            return Err(NurbsError::WeightCount { points, weights });
        }
        if !points.iter().all(|p| p.is_finite()) || !weights.iter().all(|w| w.is_finite()) {
            return Err(NurbsError::NotFinite);
        }
        if let Some(at) = weights.iter().position(|&w| !(w > 0.0)) {
            return Err(NurbsError::Weight { at, weight: weights[at] });
        }
        let control = points.iter().zip(weights).map(|(p, &w)| (*p * w).extend(w)).collect();
        Ok(Self { degree, knots, count, control })
    }

    /// The same surface as Bézier patches, one for each pair of knot intervals. Texture coordinates go
    /// from 0 to 1 over the surface, in proportion to its parameters.
    pub fn to_bezier(&self) -> Vec<BezierPatch> {
        let [p, q] = self.degree;
        let [columns, _] = self.count;
        let along_u = Pieces::new(p, &self.knots[0]);
        let along_v = Pieces::new(q, &self.knots[1]);
        let mut patches = Vec::with_capacity(along_u.spans.len() * along_v.spans.len());
        for &span_v in &along_v.spans {
            // Control points of the piece along v, one row for each of its q + 1, as B-splines along u.
            let mut rows = vec![DVec4::ZERO; (q + 1) * columns];
            for column in 0..columns {
                let at = |j: usize| self.control[(span_v - q + j) * columns + column];
                let curve: Vec<DVec4> = (0..=q).map(at).collect();
                for (j, c) in along_v.control(span_v, &curve).into_iter().enumerate() {
                    rows[j * columns + column] = c;
                }
            }
            for &span_u in &along_u.spans {
                let first = span_u - p;
                let control = rows
                    .chunks_exact(columns)
                    .flat_map(|row| along_u.control(span_u, &row[first..=span_u]))
                    .collect();
                let corner = |k: usize| {
                    DVec2::new(along_u.fraction(span_u + k), along_v.fraction(span_v + k))
                };
                patches.push(BezierPatch::rational([p, q], control, [corner(0), corner(1)]));
            }
        }
        patches
    }
}

fn check_knots(
    along: &'static str,
    degree: usize,
    count: usize,
    knots: &[f64],
) -> Result<(), NurbsError> {
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(NurbsError::Degree { along, degree });
    }
    if count <= degree {
        return Err(NurbsError::Control { along, degree, count });
    }
    if knots.len() != count + degree + 1 {
        return Err(NurbsError::KnotCount { along, count, degree, knots: knots.len() });
    }
    if !knots.iter().all(|k| k.is_finite()) {
        return Err(NurbsError::NotFinite);
    }
    if let Some(at) = knots.windows(2).position(|pair| pair[1] < pair[0]) {
        return Err(NurbsError::KnotOrder { along, at: at + 1 });
    }
    if let Some(run) = knots.windows(degree + 2).find(|run| run[0] == run[degree + 1]) {
        return Err(NurbsError::KnotMultiplicity { along, knot: run[0], degree });
    }
    if knots[degree] == knots[count] {
        return Err(NurbsError::KnotDomain { along });
    }
    Ok(())
}

/// The polynomial pieces of B-splines over one list of knots.
struct Pieces<'a> {
    degree: usize,
    knots: &'a [f64],
    /// Indices i of the intervals [t_i, t_i+1] that are not empty and where the splines are defined.
    spans: Vec<usize>,
}

impl<'a> Pieces<'a> {
    fn new(degree: usize, knots: &'a [f64]) -> Self {
        let last = knots.len() - degree - 1;
        let spans = (degree..last).filter(|&i| knots[i] < knots[i + 1]).collect();
        Self { degree, knots, spans }
    }

    /// Where a knot is between the first (0) and the last (1) of the domain.
    fn fraction(&self, knot: usize) -> f64 {
        let (low, high) = (self.knots[self.degree], self.knots[self.knots.len() - self.degree - 1]);
        (self.knots[knot] - low) / (high - low)
    }

    /// Bézier control points over interval `span` of the spline with these p + 1 control points: the
    /// values of its blossom for p − k times the start and k times the end.
    fn control(&self, span: usize, points: &[DVec4]) -> Vec<DVec4> {
        let p = self.degree;
        let (start, end) = (self.knots[span], self.knots[span + 1]);
        let value = |k: usize| {
            let mut d = [DVec4::ZERO; MAX_DEGREE + 1];
            d[..=p].copy_from_slice(points);
            // de Boor's algorithm, with an argument of its own at every stage.
            for r in 1..=p {
                let t = if r <= p - k { start } else { end };
                for j in (r..=p).rev() {
                    let low = self.knots[span - p + j];
                    let high = self.knots[span + 1 + j - r];
                    d[j] = d[j - 1] + (d[j] - d[j - 1]) * ((t - low) / (high - low));
                }
            }
            d[p]
        };
        (0..=p).map(value).collect()
    }
}
