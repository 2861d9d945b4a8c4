//! Where things are: objects become geometry in the space they are traced in.
//!
//! The world is moved by an f64 centre before anything is rounded to f32, and each prototype by its
//! own, but only where coordinates are far compared with their extent: then f32 would lose digits
//! that the file has. Nearer than that nothing is moved, so vertices stay the file's own, bit by bit.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::build::{NameIndex, SceneError};
use super::desc::{Location, ObjectDesc, SceneDesc, ShapeDesc};
use super::draft::{Draft, DraftCopy, DraftLook, GeometryLooks};
use super::maps::Maps;
use crate::accel::{InstanceSet, World, rows_from_affine};
use crate::geometry::{Plane, TriangleMesh};
use crate::math::Bounds;

/// The world to be traced, and what belongs to it.
#[derive(Debug, Default)]
pub(super) struct Placed {
    pub(super) world: World,
    /// The looks of every geometry of the root group and of each prototype, in the world's order.
    pub(super) root_looks: Vec<GeometryLooks>,
    pub(super) prototype_looks: Vec<Vec<GeometryLooks>>,
    /// The objects that the copies of each set belong to.
    pub(super) copy_objects: Vec<CopyObjects>,
    /// Where textures lie: texture space from the group's. The first is the identity; there are no
    /// others where no material has a texture.
    pub(super) frames: Vec<DAffine3>,
    /// What was subtracted from all world coordinates.
    pub(super) center: DVec3,
}

/// The numbers of the objects that the copies of a set belong to.
#[derive(Debug)]
pub(super) enum CopyObjects {
    /// All to one.
    One(u32),
    /// By copy.
    Each(Vec<u32>),
}

impl CopyObjects {
    fn new(objects: Vec<u32>) -> Self {
        match objects.first() {
            Some(first) if objects.iter().all(|object| object == first) => Self::One(*first),
            _ => Self::Each(objects),
        }
    }

    pub(super) fn of(&self, copy: u32) -> u32 {
        match self {
            Self::One(object) => *object,
            Self::Each(objects) => objects[copy as usize],
        }
    }
}

/// Identity of a draft that several objects may share: what it holds, its material and, where that has
/// textures, the bits of where they lie.
#[derive(Debug, PartialEq, Eq, Hash)]
enum Shared {
    Mesh(usize, u32, Option<[u64; 12]>),
    Prototype(usize),
}

/// Coordinates beyond this overflow in f32 ray queries, whose edge tests grow with the third power.
const MAX_REACH: f64 = 1e12;

/// A scene smaller than this vanishes in them.
const MIN_EXTENT: f64 = 1e-10;

/// Scales of copies that a query can invert in f32.
const COPY_SCALES: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// Prototypes within prototypes.
const MAX_NESTING: usize = 64;

/// Copies in all: some 300 bytes each.
const MAX_COPIES: u64 = 200_000_000;

struct Placer<'a> {
    materials: &'a NameIndex,
    /// The textures of each material, by index.
    maps: &'a [Maps],
    /// Whether each material gives off light.
    glows: &'a [bool],
    /// Whether each mesh has texture coordinates.
    has_uvs: Vec<bool>,
    prototype_names: &'a NameIndex,
    prototypes: Vec<Option<Vec<ObjectDesc>>>,
    mesh_uses: Vec<u32>,
    drafts: Vec<Draft>,
    shared: HashMap<Shared, usize>,
    errors: Vec<SceneError>,
}

/// Places everything that `desc` holds, taking its meshes and objects. `glows` and `clear` are by
/// material; shadow rays take no notice of what is `clear`, which is empty where nothing is.
pub(super) fn place(
    desc: &mut SceneDesc,
    materials: &NameIndex,
    prototype_names: &NameIndex,
    maps: &[Maps],
    glows: &[bool],
    clear: &[bool],
) -> Result<Placed, Vec<SceneError>> {
    let mut mesh_uses = vec![0; desc.meshes.len()];
    let all = desc.prototypes.iter().flat_map(|p| &p.objects).chain(&desc.objects);
    for object in all {
        if let ShapeDesc::Mesh(mesh) = object.shape {
            mesh_uses[mesh] += 1;
        }
    }
    let mut placer = Placer {
        materials,
        maps,
        glows,
        has_uvs: desc.meshes.iter().map(|mesh| mesh.uvs.is_some()).collect(),
        prototype_names,
        prototypes: desc
            .prototypes
            .iter_mut()
            .map(|p| Some(std::mem::take(&mut p.objects)))
            .collect(),
        mesh_uses,
        drafts: Vec::new(),
        shared: HashMap::new(),
        errors: Vec::new(),
    };
    let root = placer.draft(std::mem::take(&mut desc.objects), 0);
    // Prototypes that nothing copies are checked all the same.
    for index in 0..placer.prototypes.len() {
        placer.prototype(index, 1);
    }
    if !placer.errors.is_empty() {
        return Err(placer.errors);
    }
    let drafts = placer.drafts;
    let mut meshes: Vec<Option<TriangleMesh>> =
        std::mem::take(&mut desc.meshes).into_iter().map(Some).collect();
    let mesh_bounds: Vec<Bounds> = meshes
        .iter()
        .map(|m| m.as_ref().map_or(Bounds::EMPTY, |m| m.bounds().translated(m.origin)))
        .collect();

    let copies = flatten(&root, &drafts).map_err(|e| vec![e])?;
    let (mut root, mut drafts) = (root, drafts);
    lift_planes(&mut root, &mut drafts, &copies);
    let bounds: Vec<Bounds> = drafts.iter().map(|d| d.bounds(&mesh_bounds)).collect();
    let mut world_bounds = root.bounds(&mesh_bounds);
    for volume in &desc.volumes {
        world_bounds = world_bounds.union(volume.bounds());
    }
    for (b, transforms) in bounds.iter().zip(&copies) {
        let around = |w: Bounds, (m, _): &(DAffine3, u32)| w.union(b.transformed(m));
        world_bounds = transforms.iter().fold(world_bounds, around);
    }
    let center = world_bounds.far_center();
    let errors = out_of_range(&world_bounds.translated(-center), &bounds);
    if !errors.is_empty() {
        return Err(errors);
    }

    let mut placed = Placed { center, frames: vec![DAffine3::IDENTITY], ..Placed::default() };
    // A draft of nothing but copies is no group of its own.
    let has_shapes = |d: &Draft| !d.meshes.is_empty() || !d.shapes.is_empty();
    let used = |d: &Draft, c: &[(DAffine3, u32)]| !c.is_empty() && has_shapes(d);
    let mut uses_left = vec![0u32; meshes.len()];
    let kept = drafts.iter().zip(&copies).filter(|(d, c)| used(d, c)).map(|(d, _)| d);
    for (mesh, ..) in kept.chain([&root]).flat_map(|d| &d.meshes) {
        uses_left[*mesh] += 1;
    }
    let frames = &mut placed.frames;
    let mut group =
        |draft: Draft, o: DVec3| draft.group(o, &mut meshes, &mut uses_left, frames, clear);
    (placed.world.root, placed.root_looks) = group(root, center);
    for ((draft, transforms), bounds) in drafts.into_iter().zip(&copies).zip(&bounds) {
        if !used(&draft, transforms) {
            continue;
        }
        let origin = bounds.far_center();
        let (group, looks) = group(draft, origin);
        let rows = transforms.iter().map(|(m, _)| {
            let centred =
                DAffine3::from_translation(-center) * *m * DAffine3::from_translation(origin);
            rows_from_affine(&centred)
        });
        placed.world.sets.push(InstanceSet {
            prototype: placed.world.prototypes.len() as u32,
            transforms: Arc::new(rows.collect()),
        });
        let objects = transforms.iter().map(|(_, object)| *object).collect();
        placed.copy_objects.push(CopyObjects::new(objects));
        placed.world.prototypes.push(group);
        placed.prototype_looks.push(looks);
    }
    Ok(placed)
}

impl Placer<'_> {
    fn draft(&mut self, objects: Vec<ObjectDesc>, depth: usize) -> Draft {
        let mut draft = Draft::default();
        for (number, object) in (0..).zip(objects) {
            let material = match &object.material {
                // Index 0 is the neutral default.
                None => 0,
                Some(reference) => match self.materials.find(reference, "material") {
                    Ok(index) => index + 1,
                    Err(error) => {
                        self.errors.push(error);
                        0
                    }
                },
            };
            let m = object.transform;
            let checked = check_transform(&m, "transform", &object.at).and_then(|()| {
                check_transform(&object.texture_transform, "texture_transform", &object.at)
            });
            if let Err(error) = checked {
                self.errors.push(error);
                continue;
            }
            // Textures lie in the object's own space, moved by its `texture_transform`.
            let look = |object_from_group: &DAffine3| -> DraftLook {
                let has_maps = !self.maps[material as usize].is_empty();
                let textures = object.texture_transform.inverse();
                let frame = has_maps.then(|| textures * *object_from_group);
                DraftLook { material, frame, object: number }
            };
            let has_uvs = match object.shape {
                ShapeDesc::Mesh(mesh) => self.has_uvs[mesh],
                ShapeDesc::Quadric(_) | ShapeDesc::Implicit(_) | ShapeDesc::Isosurface(_) => false,
                _ => true,
            };
            if !has_uvs && self.maps[material as usize].needs_uv() {
                self.errors.push(SceneError::NoTextureCoordinates {
                    at: object.at.clone(),
                    material: self.materials.name(material - 1).to_owned(),
                });
            }
            match object.shape {
                ShapeDesc::Mesh(mesh) if self.mesh_uses[mesh] == 1 => {
                    draft.meshes.push((mesh, m, look(&m.inverse())));
                }
                ShapeDesc::Mesh(mesh) => {
                    let look = look(&DAffine3::IDENTITY);
                    let only = || Draft {
                        meshes: vec![(mesh, DAffine3::IDENTITY, look)],
                        ..Draft::default()
                    };
                    let shared = self.share(Shared::Mesh(mesh, material, bits(&look)), only);
                    let copy = DraftCopy { draft: shared, transform: m, object: number };
                    self.copy(&mut draft, copy, &object);
                }
                ShapeDesc::Instances { ref prototype, ref transforms } => {
                    let index = match self.prototype_names.find(prototype, "prototype") {
                        Ok(index) => index as usize,
                        Err(error) => {
                            self.errors.push(error);
                            continue;
                        }
                    };
                    for (row, transform) in transforms.iter().enumerate() {
                        if let Err(error) = check_row(&(m * *transform), row, &object) {
                            self.errors.push(error);
                            break;
                        }
                    }
                    if depth == MAX_NESTING {
                        let at = prototype.at.clone();
                        self.errors.push(SceneError::NestedTooDeep { at, limit: MAX_NESTING });
                        continue;
                    }
                    match self.prototype(index, depth + 1) {
                        Some(shared) => draft.copies.extend(transforms.iter().map(|t| DraftCopy {
                            draft: shared,
                            transform: m * *t,
                            object: number,
                        })),
                        None => self.errors.push(SceneError::PrototypeCycle {
                            at: prototype.at.clone(),
                            name: prototype.name.clone(),
                        }),
                    }
                }
                ref shape => {
                    if self.glows[material as usize] && !can_glow(shape) {
                        self.errors.push(SceneError::CannotGlow { at: object.at.clone() });
                    }
                    draft.add_shape(shape, &m, look(&m.inverse()));
                }
            }
        }
        draft
    }

    /// Adds a copy that stands for one object.
    fn copy(&mut self, draft: &mut Draft, copy: DraftCopy, object: &ObjectDesc) {
        match check_row(&copy.transform, 0, object) {
            Ok(()) => draft.copies.push(copy),
            Err(error) => self.errors.push(error),
        }
    }

    fn share(&mut self, key: Shared, make: impl FnOnce() -> Draft) -> usize {
        *self.shared.entry(key).or_insert_with(|| {
            self.drafts.push(make());
            self.drafts.len() - 1
        })
    }

    /// The draft of a prototype, made on first use. None while it is being made: it contains itself.
    fn prototype(&mut self, index: usize, depth: usize) -> Option<usize> {
        if let Some(&draft) = self.shared.get(&Shared::Prototype(index)) {
            return Some(draft);
        }
        let objects = self.prototypes[index].take()?;
        let draft = self.draft(objects, depth);
        self.drafts.push(draft);
        self.shared.insert(Shared::Prototype(index), self.drafts.len() - 1);
        Some(self.drafts.len() - 1)
    }
}

/// What tells one texture space from another.
fn bits(look: &DraftLook) -> Option<[u64; 12]> {
    look.frame.map(|frame| frame.to_cols_array().map(f64::to_bits))
}

/// Whether points on a shape can be drawn at random, as light sources need.
fn can_glow(shape: &ShapeDesc) -> bool {
    !matches!(shape, ShapeDesc::Plane { .. } | ShapeDesc::Quadric(_) | ShapeDesc::Implicit(_))
}

pub(super) fn check_transform(
    m: &DAffine3,
    what: &'static str,
    at: &Location,
) -> Result<(), SceneError> {
    if !m.is_finite() {
        return Err(SceneError::TransformNotFinite { at: at.clone(), what });
    }
    if is_singular(&m.matrix3) {
        return Err(SceneError::TransformSingular { at: at.clone(), what });
    }
    Ok(())
}

fn check_row(m: &DAffine3, row: usize, object: &ObjectDesc) -> Result<(), SceneError> {
    let at = || object.at.clone();
    if !m.is_finite() || is_singular(&m.matrix3) {
        return Err(SceneError::CopySingular { at: at(), row });
    }
    let axes = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis].map(DVec3::length);
    match axes.into_iter().find(|scale| !COPY_SCALES.contains(scale)) {
        Some(scale) => Err(SceneError::CopyScale { at: at(), row, scale }),
        None => Ok(()),
    }
}

/// World from draft for every copy of every draft, nested ones included, and the scene's object that it
/// belongs to: one level instead of many.
fn flatten(root: &Draft, drafts: &[Draft]) -> Result<Vec<Vec<(DAffine3, u32)>>, SceneError> {
    let count = count_copies(root, drafts);
    if count > MAX_COPIES {
        return Err(SceneError::TooManyCopies { count, limit: MAX_COPIES });
    }
    let mut copies = vec![Vec::new(); drafts.len()];
    let mut pending = root.copies.clone();
    while let Some(DraftCopy { draft, transform, object }) = pending.pop() {
        copies[draft].push((transform, object));
        pending.extend(drafts[draft].copies.iter().map(|copy| DraftCopy {
            draft: copy.draft,
            transform: transform * copy.transform,
            object,
        }));
    }
    // The stack reversed their order.
    copies.iter_mut().for_each(|c| c.reverse());
    Ok(copies)
}

/// Planes have no end, so that no box is around a copy of one: each copy becomes a plane of the world.
fn lift_planes(root: &mut Draft, drafts: &mut [Draft], copies: &[Vec<(DAffine3, u32)>]) {
    for (draft, transforms) in drafts.iter_mut().zip(copies) {
        for (plane, look) in draft.take::<Plane>() {
            for (m, object) in transforms {
                let frame = look.frame.map(|frame| frame * m.inverse());
                root.add(plane.transformed(m), DraftLook { frame, object: *object, ..look });
            }
        }
    }
}

/// What f32 ray queries cannot hold, of the recentred world and of its prototypes.
fn out_of_range(world: &Bounds, prototypes: &[Bounds]) -> Vec<SceneError> {
    let mut errors = Vec::new();
    let reach = world.min.abs().max(world.max.abs()).max_element();
    if !world.is_empty() && !(reach <= MAX_REACH) {
        errors.push(SceneError::TooLarge { reach });
    }
    let small = |bounds: &Bounds, what: &'static str| {
        let extent = bounds.size().max_element();
        let is_small = extent > 0.0 && extent < MIN_EXTENT;
        is_small.then_some(SceneError::TooSmall { what, extent })
    };
    errors.extend(small(world, "the scene"));
    errors.extend(prototypes.iter().filter_map(|b| small(b, "a prototype")));
    errors
}

/// Copies of all drafts once nesting is resolved, however many that would be.
fn count_copies(root: &Draft, drafts: &[Draft]) -> u64 {
    // A draft is made after those that it copies, so their counts are known.
    let mut below: Vec<u64> = Vec::with_capacity(drafts.len());
    let count = |draft: &Draft, below: &[u64]| {
        let one = |n: u64, c: &DraftCopy| n.saturating_add(1).saturating_add(below[c.draft]);
        draft.copies.iter().fold(0, one)
    };
    for draft in drafts {
        below.push(count(draft, &below));
    }
    count(root, &below)
}

/// Whether a matrix flattens space, to within f32.
fn is_singular(m: &DMat3) -> bool {
    let volume = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    // Also refuses NaN.
    !(m.determinant().abs() > 1e-9 * volume)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_matrices_are_singular_at_any_scale() {
        assert!(is_singular(&DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0))));
        assert!(is_singular(&DMat3::from_cols(DVec3::X, DVec3::X, DVec3::Z)));
        assert!(is_singular(&DMat3::ZERO));
        assert!(!is_singular(&DMat3::from_diagonal(DVec3::splat(1e-12))));
    }
}
