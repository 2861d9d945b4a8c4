//! How far the limit surface may be from the triangles between limit points.
//!
//! About a regular face the surface is a bicubic B-spline, whose second derivatives are at most the
//! largest second differences of its 16 control points: the bound of [`super::super::dice`]. Where that is
//! too much, as about extraordinary vertices, where parameters are uneven, and at creases and boundaries,
//! a face is refined a few levels further by itself. There the distance of the new limit points is measured, and to it is added how thick the hull of the
//! control points of each small face is across that face, within which the surface lies. Across is what
//! counts: sideways the triangles of one face end where those of the next begin, but for creases and
//! boundaries, which are bounded as curves.

use glam::DVec3;
use rayon::prelude::*;

use super::Polygons;
use super::limit::{Limit, cut, quad};
use super::refine::{Rule, Surroundings, Topology, refine};
use crate::geometry::distance_to_triangle;

/// Levels that a face is refined further.
const FURTHER: usize = 3;

/// Whether the surface is nowhere farther than `enough` from the triangles.
pub(super) fn is_near(mesh: &Polygons, topology: &Topology, limit: &Limit, enough: f64) -> bool {
    let is_far = |f: usize| {
        let bound = regular(mesh, limit, f).unwrap_or(f64::INFINITY);
        bound > enough && further(mesh, topology, limit, f) > enough
    };
    !(0..mesh.face_count()).into_par_iter().any(is_far)
}

/// A bound of the distance between the surface and the triangles.
pub(super) fn deviation(mesh: &Polygons, topology: &Topology, limit: &Limit) -> f64 {
    let bound = |f| further(mesh, topology, limit, f);
    (0..mesh.face_count()).into_par_iter().map(bound).reduce(|| 0.0, f64::max)
}

/// The bound for a face whose surface is a bicubic B-spline; none for others.
fn regular(mesh: &Polygons, limit: &Limit, face: usize) -> Option<f64> {
    let at = |v: u32| mesh.positions[v as usize];
    let mut along = [0.0_f64; 2];
    let mut twist = 0.0_f64;
    for k in 0..4u32 {
        let c = 4 * face as u32 + k;
        let v = mesh.corners[c as usize];
        let sector = limit.sector(v, c);
        if limit.rules[v as usize] != Rule::Smooth || limit.sharp[v as usize] != 0 {
            return None;
        }
        if sector.corners.len() != 4 || !sector.is_closed {
            return None;
        }
        // Around the vertex, from this face on: e0 f0 e1 f1 e2 f2 e3 f3.
        let first = sector.corners.iter().position(|&other| other == c)?;
        let ring = |i: usize| quad(mesh, sector.corners[(first + i) % 4]);
        let e: [DVec3; 4] = std::array::from_fn(|i| at(ring(i)[1]));
        let f: [DVec3; 4] = std::array::from_fn(|i| at(ring(i)[2]));
        let bend = |a: DVec3, b: DVec3, c: DVec3| (a - 2.0 * b + c).length();
        // e0 lies along u from the first and third corner, along v from the others.
        let (u, v_) = (k as usize % 2, (k as usize + 1) % 2);
        along[u] = along[u].max(bend(e[0], at(v), e[2])).max(bend(f[2], e[3], f[3]));
        along[v_] = along[v_].max(bend(e[1], at(v), e[3])).max(bend(f[1], e[2], f[2]));
        for i in 0..4 {
            twist = twist.max((at(v) - e[i] + f[i] - e[(i + 1) % 4]).length());
        }
    }
    Some(0.125 * (along[0] + 2.0 * twist + along[1]))
}

/// A bound for any face.
fn further(mesh: &Polygons, topology: &Topology, limit: &Limit, face: usize) -> f64 {
    let corners = std::array::from_fn(|k| limit.positions[mesh.face(face)[k] as usize]);
    let triangles = cut(&corners).map(|t| t.map(|k| corners[k]));
    // The face and those around it, as far as the surface on this side of creases goes.
    let mut part = neighborhood(mesh, topology, limit, &[face]);
    let mut count = 1;
    for _ in 0..FURTHER {
        let topology = Topology::new(&part);
        part = refine(&part, &topology);
        count *= 4;
        let topology = Topology::new(&part);
        let limit = Limit::new(&part, &topology);
        let own: Vec<usize> = (0..count).collect();
        part = neighborhood(&part, &topology, &limit, &own);
    }
    let topology = Topology::new(&part);
    let limit = Limit::new(&part, &topology);
    let around = Surroundings::of_all(&part, &topology);
    let mut off = 0.0_f64;
    let mut thickness = 0.0_f64;
    for f in 0..count {
        for &v in part.face(f) {
            let p = limit.positions[v as usize];
            // Creases are cubic B-splines, along the surface too.
            if limit.rules[v as usize] == Rule::Crease {
                let bend = around[v as usize].sharp_neighbors - 2.0 * part.positions[v as usize];
                thickness = thickness.max(0.125 * bend.length());
            }
            let nearest =
                triangles.iter().map(|t| distance_to_triangle(p, t)).fold(f64::INFINITY, f64::min);
            off = off.max(nearest);
        }
        let hull = hull_thickness(&part, &limit, f);
        thickness = thickness.max(regular(&part, &limit, f).map_or(hull, |bound| bound.min(hull)));
    }
    off + thickness
}

/// How far the control points of the surface over a face reach across it.
fn hull_thickness(mesh: &Polygons, limit: &Limit, face: usize) -> f64 {
    let corner = |k: usize| limit.positions[mesh.face(face)[k] as usize];
    let normal = (corner(2) - corner(0)).cross(corner(3) - corner(1)).normalize_or_zero();
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for c in 4 * face as u32..4 * face as u32 + 4 {
        for &other in &limit.sector(mesh.corners[c as usize], c).corners {
            for v in quad(mesh, other) {
                let height = normal.dot(mesh.positions[v as usize] - corner(0));
                range = [range[0].min(height), range[1].max(height)];
            }
        }
    }
    range[1] - range[0]
}

/// A mesh of the given faces, in this order, and those that share a vertex with them and are not beyond
/// a sharp edge.
fn neighborhood(mesh: &Polygons, topology: &Topology, limit: &Limit, own: &[usize]) -> Polygons {
    let mut faces = own.to_vec();
    let mut others: Vec<usize> = Vec::new();
    for &f in own {
        for c in 4 * f as u32..4 * f as u32 + 4 {
            let sector = limit.sector(mesh.corners[c as usize], c);
            others.extend(sector.corners.iter().map(|&c| c as usize / 4));
        }
    }
    others.sort_unstable();
    others.dedup();
    let is_own = |f: &usize| own.binary_search(f).is_ok();
    faces.extend(others.into_iter().filter(|f| !is_own(f)));

    let mut vertices: Vec<u32> = faces.iter().flat_map(|&f| mesh.face(f)).copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    let number = |v: u32| vertices.binary_search(&v).map(|i| i as u32).ok();
    let corners: Vec<u32> =
        faces.iter().flat_map(|&f| mesh.face(f)).filter_map(|&v| number(v)).collect();
    let mut creases: Vec<[u32; 2]> = Vec::new();
    for &f in &faces {
        for c in 4 * f..4 * f + 4 {
            let edge = &topology.edges[topology.edge_of_corner[c] as usize];
            if edge.is_sharp
                && let [Some(a), Some(b)] = edge.ends.map(number)
            {
                creases.push([a, b]);
            }
        }
    }
    creases.sort_unstable();
    creases.dedup();
    // What is a corner there stays one, with however few of its edges.
    let is_corner = |v: &u32| limit.rules[*v as usize] == Rule::Corner;
    let pinned = vertices.iter().filter(|v| is_corner(v)).filter_map(|&v| number(v)).collect();
    Polygons {
        positions: vertices.iter().map(|&v| mesh.positions[v as usize]).collect(),
        starts: (0..=corners.len() as u32).step_by(4).collect(),
        corners,
        creases,
        pinned,
    }
}
