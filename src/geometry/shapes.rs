//! The kinds of shapes, each in a list of its own: whoever works on a list is compiled for its kind.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::{
    AnalyticShape, Cone, Cuboid, Disk, Framed, Implicit, Isosurface, Plane, Polygon, Quadric,
    Sphere, Torus,
};
use crate::math::Bounds;

/// A shape that is placed in a group, in a list of its kind.
pub trait PlacedShape: AnalyticShape {
    /// Moves it.
    fn translate(&mut self, by: DVec3);

    /// A list of one.
    fn list(self) -> Shapes;

    /// The list, if it is one of this kind.
    fn of(shapes: &mut Shapes) -> Option<&mut Vec<Self>>;
}

/// Declares the kinds. (The dollar is passed in as it cannot be written within a macro that a macro
/// defines.)
macro_rules! shape_kinds {
    (($d:tt) $($(#[$doc:meta])* $variant:ident($shape:ty) $names:expr, $translate:expr;)*) => {
        /// Many shapes of one kind.
        #[derive(Debug, Clone)]
        pub enum Shapes {
            $($(#[$doc])* $variant(Arc<Vec<$shape>>),)*
        }

        $(impl PlacedShape for $shape {
            fn translate(&mut self, by: DVec3) {
                let translate: fn(&mut Self, DVec3) = $translate;
                translate(self, by);
            }

            fn list(self) -> Shapes {
                Shapes::$variant(Arc::new(vec![self]))
            }

            fn of(shapes: &mut Shapes) -> Option<&mut Vec<Self>> {
                match shapes {
                    Shapes::$variant(list) => Some(Arc::make_mut(list)),
                    _ => None,
                }
            }
        }

        impl From<Vec<$shape>> for Shapes {
            fn from(shapes: Vec<$shape>) -> Self {
                Self::$variant(Arc::new(shapes))
            }
        })*

        impl Shapes {
            /// What one and what many of them are called in reports.
            pub const fn names(&self) -> [&'static str; 2] {
                match self {
                    $(Self::$variant(_) => $names,)*
                }
            }
        }

        /// Runs one expression over the list of whichever kind it is.
        macro_rules! with_shapes {
            ($d shapes:expr, $d list:ident => $d body:expr) => {
                match $d shapes {
                    $($crate::geometry::Shapes::$variant($d list) => $d body,)*
                }
            };
        }
        pub(crate) use with_shapes;
    };
}

/// Moves a framed shape.
fn moved<S: AnalyticShape>(shape: &mut Framed<S>, by: DVec3) {
    *shape = shape.transformed(&DAffine3::from_translation(by));
}

shape_kinds! {
    ($)
    /// Spheres.
    Spheres(Sphere) ["sphere", "spheres"], |s, by| s.center += by;
    /// Spheres that are stretched more along one axis than along another.
    Ellipsoids(Framed<Sphere>) ["ellipsoid", "ellipsoids"], moved;
    /// Flat disks and rings.
    Disks(Disk) ["disk", "disks"], |d, by| d.center += by;
    /// Disks that are stretched more along one axis than along another.
    FramedDisks(Framed<Disk>) ["stretched disk", "stretched disks"], moved;
    /// Boxes along the axes.
    Boxes(Cuboid) ["box", "boxes"], |b, by| {
        b.bounds = b.bounds.translated(by);
    };
    /// Boxes that are turned or sheared.
    FramedBoxes(Framed<Cuboid>) ["turned box", "turned boxes"], moved;
    /// Cylinders, cones and truncated cones.
    Cones(Framed<Cone>) ["cylinder or cone", "cylinders and cones"], moved;
    /// Tori.
    Tori(Framed<Torus>) ["torus", "tori"], moved;
    /// Planes without end.
    Planes(Plane) ["plane", "planes"], |p, by| p.point += by;
    /// Quadrics.
    Quadrics(Framed<Quadric>) ["quadric", "quadrics"], moved;
    /// Implicit surfaces.
    Implicits(Framed<Implicit>) ["implicit surface", "implicit surfaces"], moved;
    /// Isosurfaces of grids.
    Isosurfaces(Framed<Isosurface>) ["isosurface", "isosurfaces"], moved;
    /// Flat polygons.
    Polygons(Polygon) ["polygon", "polygons"], |p, by| {
        *p = p.transformed(&DAffine3::from_translation(by));
    };
}

impl Shapes {
    /// Number of shapes.
    pub fn len(&self) -> usize {
        with_shapes!(self, list => list.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The box around all of them.
    pub fn bounds(&self) -> Bounds {
        with_shapes!(self, list => {
            list.iter().map(AnalyticShape::bounds).fold(Bounds::EMPTY, Bounds::union)
        })
    }

    /// The others, and those whose index is `chosen`, each in order.
    #[must_use]
    pub fn split(&self, chosen: impl Fn(usize) -> bool) -> [Self; 2] {
        with_shapes!(self, list => {
            let part = |is_chosen| {
                let indices = (0..list.len()).filter(|i| chosen(*i) == is_chosen);
                Self::from(indices.map(|i| Clone::clone(&list[i])).collect::<Vec<_>>())
            };
            [part(false), part(true)]
        })
    }

    /// Whether any of them has no end.
    pub fn is_endless(&self) -> bool {
        matches!(self, Self::Planes(planes) if !planes.is_empty())
    }

    /// All of them moved, without a copy where nothing else holds the list.
    #[must_use]
    pub fn translated(mut self, by: DVec3) -> Self {
        if by != DVec3::ZERO {
            with_shapes!(&mut self, list => {
                Arc::make_mut(list).iter_mut().for_each(|shape| shape.translate(by));
            });
        }
        self
    }
}
