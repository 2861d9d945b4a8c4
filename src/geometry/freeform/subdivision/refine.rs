//! Which faces meet where, and one step of subdivision.

use glam::DVec3;
use rayon::prelude::*;

use super::Polygons;

/// An edge and what it joins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    /// Its ends, the lower first.
    pub ends: [u32; 2],
    /// Two of its faces; the same twice on a boundary.
    pub faces: [u32; 2],
    /// Whether the surface has a crease or an end there.
    pub is_sharp: bool,
}

impl Edge {
    fn other(&self, v: u32) -> u32 {
        if self.ends[0] == v { self.ends[1] } else { self.ends[0] }
    }
}

/// The edges of a mesh.
#[derive(Debug)]
pub(super) struct Topology {
    /// In the order of their ends.
    pub edges: Vec<Edge>,
    /// For each corner of [`Polygons::corners`] the edge to the next corner of its face.
    pub edge_of_corner: Vec<u32>,
}

impl Topology {
    pub(super) fn new(mesh: &Polygons) -> Self {
        // (ends, corner, face, whether the face goes from the higher to the lower).
        let mut halves: Vec<([u32; 2], u32, u32, bool)> = Vec::with_capacity(mesh.corners.len());
        for (f, face) in (0u32..).zip(mesh.faces()) {
            let start = mesh.starts[f as usize];
            for (k, (&a, &b)) in (0u32..).zip(face.iter().zip(face.iter().cycle().skip(1))) {
                halves.push(([a.min(b), a.max(b)], start + k, f, a > b));
            }
        }
        halves.par_sort_unstable();
        let mut edges = Vec::with_capacity(halves.len() / 2 + 1);
        let mut edge_of_corner = vec![0; mesh.corners.len()];
        for group in halves.chunk_by(|a, b| a.0 == b.0) {
            let number = edges.len() as u32;
            group.iter().for_each(|half| edge_of_corner[half.1 as usize] = number);
            let [first, last] = [group[0], group[group.len() - 1]];
            let is_plain = group.len() == 2 && first.3 != last.3;
            let is_sharp = !is_plain || mesh.creases.binary_search(&first.0).is_ok();
            edges.push(Edge { ends: first.0, faces: [first.2, last.2], is_sharp });
        }
        Self { edges, edge_of_corner }
    }

    /// The edge between two vertices, the lower first.
    pub(super) fn edge(&self, ends: [u32; 2]) -> Option<&Edge> {
        self.edges.binary_search_by_key(&ends, |edge| edge.ends).ok().map(|i| &self.edges[i])
    }

    /// Vertices that stay in their place: of three sharp edges or more, or of a single face.
    pub(super) fn corners(&self, mesh: &Polygons) -> Vec<u32> {
        let mut faces = vec![0u32; mesh.positions.len()];
        mesh.corners.iter().for_each(|&v| faces[v as usize] += 1);
        let mut sharp = vec![0u32; mesh.positions.len()];
        for edge in self.edges.iter().filter(|edge| edge.is_sharp) {
            edge.ends.iter().for_each(|&v| sharp[v as usize] += 1);
        }
        let is_corner = |v: &u32| {
            let (faces, sharp) = (faces[*v as usize], sharp[*v as usize]);
            sharp > 2 || (faces == 1 && sharp == 2)
        };
        (0..mesh.positions.len() as u32).filter(is_corner).collect()
    }
}

/// What a vertex is surrounded by.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Surroundings {
    /// Number of edges.
    pub edges: u32,
    /// Number of faces.
    pub faces: u32,
    /// Number of sharp edges.
    pub sharp: u32,
    /// Sum of the vertices at the other ends of the edges.
    pub neighbors: DVec3,
    /// The same of sharp edges.
    pub sharp_neighbors: DVec3,
    /// Whether it stays in its place.
    pub is_pinned: bool,
}

/// How a vertex moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rule {
    Smooth,
    Crease,
    Corner,
}

impl Surroundings {
    pub(super) fn rule(&self) -> Rule {
        match self.sharp {
            _ if self.is_pinned || self.faces == 0 => Rule::Corner,
            0 | 1 => Rule::Smooth,
            2 => Rule::Crease,
            _ => Rule::Corner,
        }
    }

    pub(super) fn of_all(mesh: &Polygons, topology: &Topology) -> Vec<Self> {
        let mut all = vec![Self::default(); mesh.positions.len()];
        for edge in &topology.edges {
            for v in edge.ends {
                let at = &mut all[v as usize];
                let neighbor = mesh.positions[edge.other(v) as usize];
                at.edges += 1;
                at.neighbors += neighbor;
                if edge.is_sharp {
                    at.sharp += 1;
                    at.sharp_neighbors += neighbor;
                }
            }
        }
        mesh.corners.iter().for_each(|&v| all[v as usize].faces += 1);
        mesh.pinned.iter().for_each(|&v| all[v as usize].is_pinned = true);
        all
    }
}

/// The mesh of the next level: first the vertices of this one, moved, then a vertex for each edge, then
/// one for each face. Each corner of a face becomes a face, in their order.
pub(super) fn refine(mesh: &Polygons, topology: &Topology) -> Polygons {
    let around = Surroundings::of_all(mesh, topology);
    let at = |v: u32| mesh.positions[v as usize];
    let face_points: Vec<DVec3> = mesh
        .faces()
        .map(|face| face.iter().map(|&v| at(v)).sum::<DVec3>() / face.len() as f64)
        .collect();
    let mut face_sums = vec![DVec3::ZERO; mesh.positions.len()];
    for (face, point) in mesh.faces().zip(&face_points) {
        face.iter().for_each(|&v| face_sums[v as usize] += point);
    }

    let moved = (0..mesh.positions.len()).map(|v| {
        let (p, a) = (mesh.positions[v], &around[v]);
        match a.rule() {
            Rule::Corner => p,
            Rule::Crease => 0.75 * p + 0.125 * a.sharp_neighbors,
            Rule::Smooth => {
                let n = f64::from(a.edges);
                // F/n + 2R/n + (n − 3)V/n, where R is the mean of the edges' middles.
                let middles = 0.5 * (n * p + a.neighbors);
                (face_sums[v] / n + 2.0 * middles / n + (n - 3.0) * p) / n
            }
        }
    });
    let edge_points = topology.edges.iter().map(|edge| {
        let ends = at(edge.ends[0]) + at(edge.ends[1]);
        if edge.is_sharp {
            return 0.5 * ends;
        }
        let [f, g] = edge.faces.map(|f| face_points[f as usize]);
        0.25 * (ends + f + g)
    });
    let positions: Vec<DVec3> =
        moved.chain(edge_points).chain(face_points.iter().copied()).collect();

    let first_edge = mesh.positions.len() as u32;
    let first_face = first_edge + topology.edges.len() as u32;
    let mut corners = Vec::with_capacity(4 * mesh.corners.len());
    for (f, face) in (0u32..).zip(mesh.faces()) {
        let start = mesh.starts[f as usize] as usize;
        let edges = &topology.edge_of_corner[start..start + face.len()];
        let before = edges.iter().cycle().skip(face.len() - 1);
        for ((&v, &next), &previous) in face.iter().zip(edges).zip(before) {
            corners.extend([v, first_edge + next, first_face + f, first_edge + previous]);
        }
    }
    let starts = (0..=corners.len() as u32).step_by(4).collect();
    // A new vertex has a higher number than an old one.
    let halves = |edge: [u32; 2]| {
        let i = topology.edges.binary_search_by_key(&edge, |e| e.ends).ok()?;
        let middle = first_edge + i as u32;
        Some([[edge[0], middle], [edge[1], middle]])
    };
    let mut creases: Vec<[u32; 2]> =
        mesh.creases.iter().filter_map(|&edge| halves(edge)).flatten().collect();
    creases.sort_unstable();
    Polygons { positions, corners, starts, creases, pinned: mesh.pinned.clone() }
}
