//! Where vertices of a mesh of quadrilaterals end up, and the normals of the limit surface there.
//!
//! Sources: Halstead, Kass and DeRose, *Efficient, fair interpolation using Catmull-Clark surfaces*,
//! 1993; Biermann, Levin and Zorin, *Piecewise smooth subdivision surfaces with normal control*, 2000,
//! for creases. A vertex where a single crease ends is taken for smooth, as is usual.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::refine::{Rule, Surroundings, Topology};
use super::{Facets, Polygons};

/// The limit of every vertex.
#[derive(Debug)]
pub(super) struct Limit {
    /// One a vertex.
    pub positions: Vec<DVec3>,
    pub rules: Vec<Rule>,
    /// Sharp edges of each vertex.
    pub sharp: Vec<u32>,
    /// For each vertex with faces, its sectors: the faces between sharp edges.
    sectors: Vec<Vec<Sector>>,
}

/// The faces about a vertex from one sharp edge to the next, or all of them.
#[derive(Debug, Clone)]
pub(super) struct Sector {
    /// Corners (indices into [`Polygons::corners`]) that lie at the vertex, anticlockwise.
    pub corners: Vec<u32>,
    /// Whether they go all the way round.
    pub is_closed: bool,
    pub normal: DVec3,
}

/// The corners of the quadrilateral that has corner `c`, starting there.
pub(super) fn quad(mesh: &Polygons, c: u32) -> [u32; 4] {
    let first = c & !3;
    std::array::from_fn(|k| mesh.corners[(first + ((c + k as u32) & 3)) as usize])
}

/// The corner before `c` in its quadrilateral.
fn previous(c: u32) -> u32 {
    (c & !3) + ((c + 3) & 3)
}

impl Limit {
    pub(super) fn new(mesh: &Polygons, topology: &Topology) -> Self {
        let around = Surroundings::of_all(mesh, topology);
        let mut diagonals = vec![DVec3::ZERO; mesh.positions.len()];
        for face in mesh.faces() {
            for k in 0..4 {
                diagonals[face[k] as usize] += mesh.positions[face[(k + 2) % 4] as usize];
            }
        }
        let position = |v: usize| {
            let (p, a) = (mesh.positions[v], &around[v]);
            match a.rule() {
                Rule::Corner => p,
                Rule::Crease => (4.0 * p + a.sharp_neighbors) / 6.0,
                Rule::Smooth => {
                    let n = f64::from(a.edges);
                    (n * n * p + 4.0 * a.neighbors + diagonals[v]) / (n * (n + 5.0))
                }
            }
        };
        let mut sectors = sectors(mesh, topology);
        sectors.par_iter_mut().enumerate().for_each(|(v, sectors)| {
            for sector in sectors {
                sector.normal = normal(mesh, v as u32, around[v].rule(), sector);
            }
        });
        Self {
            positions: (0..mesh.positions.len()).into_par_iter().map(position).collect(),
            rules: around.iter().map(Surroundings::rule).collect(),
            sharp: around.iter().map(|a| a.sharp).collect(),
            sectors,
        }
    }

    /// The sector of vertex `v` that has corner `c`.
    pub(super) fn sector(&self, v: u32, c: u32) -> &Sector {
        let sectors = &self.sectors[v as usize];
        sectors.iter().find(|s| s.corners.contains(&c)).unwrap_or(&sectors[0])
    }

    /// Two triangles a face, cut along the shorter diagonal, with a vertex for each sector.
    pub(super) fn facets(&self, mesh: &Polygons) -> Facets {
        let mut facets = Facets::default();
        let mut vertex_of_corner = vec![0; mesh.corners.len()];
        for (position, sectors) in self.positions.iter().zip(&self.sectors) {
            for sector in sectors {
                let vertex = facets.positions.len() as u32;
                facets.positions.push(*position);
                facets.normals.push(sector.normal);
                sector.corners.iter().for_each(|&c| vertex_of_corner[c as usize] = vertex);
            }
        }
        for first in (0..mesh.corners.len()).step_by(4) {
            let corners: [u32; 4] = std::array::from_fn(|k| vertex_of_corner[first + k]);
            let points = std::array::from_fn(|k| self.positions[mesh.corners[first + k] as usize]);
            facets.triangles.extend(cut(&points).map(|t| t.map(|k: usize| corners[k])));
        }
        facets
    }
}

/// The two triangles of a quadrilateral.
pub(super) fn cut(points: &[DVec3; 4]) -> [[usize; 3]; 2] {
    let [a, b, c, d] = points;
    let is_ac = (*c - *a).length_squared() <= (*d - *b).length_squared();
    if is_ac { [[0, 1, 2], [0, 2, 3]] } else { [[0, 1, 3], [1, 2, 3]] }
}

/// The sectors of each vertex, without normals.
fn sectors(mesh: &Polygons, topology: &Topology) -> Vec<Vec<Sector>> {
    // The two corners of an edge that is not sharp: those whose edges it is.
    let mut corners_of_edge = vec![[u32::MAX; 2]; topology.edges.len()];
    for (c, &edge) in (0u32..).zip(&topology.edge_of_corner) {
        let slots = &mut corners_of_edge[edge as usize];
        slots[usize::from(slots[0] != u32::MAX)] = c;
    }
    let across = |c: u32| {
        let edge = topology.edge_of_corner[c as usize] as usize;
        let [a, b] = corners_of_edge[edge];
        (!topology.edges[edge].is_sharp).then_some(if a == c { b } else { a })
    };
    // Anticlockwise about the vertex of corner c: over the edge that comes in. The face there goes along
    // that edge the other way, out of the vertex.
    let next = |c: u32| across(previous(c));
    // Clockwise: over the edge that goes out; there it comes in, and the vertex is at its end.
    let back = |c: u32| across(c).map(|c| (c & !3) + ((c + 1) & 3));
    let mut sectors: Vec<Vec<Sector>> = vec![Vec::new(); mesh.positions.len()];
    let mut is_known = vec![false; mesh.corners.len()];
    for c in 0..mesh.corners.len() as u32 {
        if is_known[c as usize] {
            continue;
        }
        // To the clockwise end, unless it goes all the way round.
        let (mut start, mut is_closed) = (c, false);
        while let Some(before) = back(start) {
            start = before;
            if start == c {
                is_closed = true;
                break;
            }
        }
        let mut corners = vec![start];
        is_known[start as usize] = true;
        let mut at = start;
        while let Some(after) = next(at) {
            if after == start {
                break;
            }
            is_known[after as usize] = true;
            corners.push(after);
            at = after;
        }
        let vertex = mesh.corners[c as usize] as usize;
        sectors[vertex].push(Sector { corners, is_closed, normal: DVec3::ZERO });
    }
    sectors
}

/// The unit normal of the limit surface at a vertex, seen from a sector.
fn normal(mesh: &Polygons, v: u32, rule: Rule, sector: &Sector) -> DVec3 {
    let at = |v: u32| mesh.positions[v as usize];
    let p = at(v);
    // Relative to the vertex: the weights of a tangent add up to zero, but less exactly far away.
    let quads = || sector.corners.iter().map(|&c| quad(mesh, c));
    let faces: Vec<DVec3> = quads().map(|q| at(q[2]) - p).collect();
    let mut edges: Vec<DVec3> = quads().map(|q| at(q[1]) - p).collect();
    let k = faces.len() as f64;
    let tangents = if sector.is_closed {
        let n = k;
        let a = 1.0 + (TAU / n).cos() + (PI / n).cos() * (2.0 * (9.0 + (TAU / n).cos())).sqrt();
        let tangent = |wave: fn(f64) -> f64| {
            let weight = |i: usize| wave(TAU * i as f64 / n);
            let sum = |i: usize| a * weight(i) * edges[i] + (weight(i) + weight(i + 1)) * faces[i];
            (0..edges.len()).map(sum).sum::<DVec3>()
        };
        [tangent(f64::cos), tangent(f64::sin)]
    } else {
        let last = sector.corners[sector.corners.len() - 1];
        edges.push(at(quad(mesh, last)[3]) - p);
        let (first, last) = (edges[0], edges[edges.len() - 1]);
        if rule == Rule::Corner || rule == Rule::Smooth {
            [first, last]
        } else if faces.len() == 1 {
            // Along the crease, and into the only face.
            [first - last, first + last]
        } else {
            let theta = PI / k;
            let r = (theta.cos() + 1.0) / theta.sin();
            let mut inwards = -r * (1.0 + 2.0 * theta.cos()) * (first + last);
            // The first and the last have a sine of 0.
            for (i, edge) in edges.iter().enumerate().take(faces.len()) {
                inwards += 4.0 * (i as f64 * theta).sin() * *edge;
            }
            for (i, face) in faces.iter().enumerate() {
                let i = i as f64;
                inwards += ((i * theta).sin() + ((i + 1.0) * theta).sin()) * *face;
            }
            [first - last, inwards]
        }
    };
    let normal = tangents[0].cross(tangents[1]);
    let scale = tangents[0].length() * tangents[1].length();
    if normal.length() > 1e-9 * scale {
        return normal.normalize();
    }
    // Tangents that coincide, as of a straight angle at a corner: the mean of the faces.
    let faces = edges.iter().zip(edges.iter().cycle().skip(1)).zip(&faces);
    let areas = faces.map(|((a, b), f)| a.cross(*f) + f.cross(*b));
    areas.sum::<DVec3>().normalize_or_zero()
}
