//! How far a render is, as an EXR file: checkpoints and parts.
//!
//! Beside the picture so far (R, G, B, which every viewer shows) it has channels of whole numbers: the
//! samples that each pixel has, where its pass ends, and the nodes of its sums ([`BlockSums`]), each f64
//! as two halves of its bits. What a node's place in its tree is follows from the number of samples.

use std::ops::Range;
use std::path::Path;

use super::error::{ReadError, WriteError};
use super::exr::{Channel, ExrCompression, ExrOptions, write_channels};
use super::exr_read::{ExrHead, read_channels, read_head};
use super::layers::{center_channels, center_from};
use super::output::{Attribute, AttributeValue};
use crate::film::{
    Aov, BLOCK_LANES, BlockSums, CenterLayers, Film, Layers, PixelRect, Shares, SumNode, add_share,
};
use crate::integrator::{BranchEnds, RayCounts};
use crate::render::{BlockState, NonFinite, RenderState, block_origins};
use crate::sampler::REPLICATES;

/// The version of the format, in the attribute of this name.
const VERSION: (&str, i32) = ("alhazen.state", 1);
const FIRST: &str = "alhazen.stateFirst";
const PASSED: &str = "alhazen.statePassed";
const RAYS: &str = "alhazen.stateRays";
const NON_FINITE: &str = "alhazen.stateNonFinite";
const LAYERS: &str = "alhazen.stateLayers";

/// Most nodes of a replicate that a file may have: a range of u32 has fewer.
const MOST_NODES: usize = 64;

/// What a file of a state is written from.
#[derive(Debug)]
pub struct StateView<'a> {
    /// The picture so far.
    pub film: &'a Film,
    /// Its blocks, in the order of [`block_origins`].
    pub blocks: &'a [&'a BlockState],
    /// Number of the first sample.
    pub first_sample: u32,
    /// Number of the sample at which the last finished pass of all blocks ended.
    pub passed: u32,
    /// Rays traced.
    pub rays: &'a RayCounts,
    /// Samples that were left out.
    pub non_finite: &'a NonFinite,
}

/// What the header of a file of a state says.
#[derive(Debug)]
pub struct StateHead {
    /// Size of the whole picture.
    pub size: [u32; 2],
    /// The pixels that it holds.
    pub window: PixelRect,
    /// The samples that every pixel has, unless the last pass was cut short.
    pub samples: Range<u32>,
    /// What else it says, in alphabetical order.
    pub attributes: Vec<Attribute>,
}

/// What a file of a state holds.
#[derive(Debug)]
pub struct StateFile {
    /// Size of the whole picture.
    pub size: [u32; 2],
    /// How far the render is.
    pub state: RenderState,
    /// What the middles of pixels show, where the render was over and it was asked for.
    pub center: CenterLayers,
    /// What else the header says, in alphabetical order.
    pub attributes: Vec<Attribute>,
}

/// A block, and where the nodes of each replicate begin among its nodes.
#[derive(Clone, Copy)]
struct Placed<'a> {
    block: &'a BlockState,
    starts: [usize; REPLICATES as usize + 1],
}

impl<'a> Placed<'a> {
    fn new(block: &'a BlockState) -> Self {
        let mut starts = [0; REPLICATES as usize + 1];
        for r in 0..REPLICATES {
            let count = BlockSums::nodes_of_replicate(block.sums.samples(), r, REPLICATES);
            starts[r as usize + 1] = starts[r as usize] + count;
        }
        Self { block, starts }
    }

    /// Nodes of replicate `r`.
    fn count(&self, r: u32) -> usize {
        self.starts[r as usize + 1] - self.starts[r as usize]
    }

    /// A node of replicate `r` of the radiance, or of a layer from 1 on.
    fn node(&self, layer: usize, r: u32, slot: usize) -> Option<&'a SumNode> {
        let sums = match layer.checked_sub(1) {
            None => &self.block.sums,
            Some(layer) => &self.block.layers[layer],
        };
        (slot < self.count(r)).then(|| &sums.nodes()[self.starts[r as usize] + slot])
    }
}

/// Blocks by their place.
struct Grid<'a> {
    /// First column and row of blocks, and blocks in a row.
    x0: u32,
    y0: u32,
    columns: u32,
    blocks: Vec<Option<Placed<'a>>>,
}

impl<'a> Grid<'a> {
    fn new(window: &PixelRect, blocks: &[&'a BlockState]) -> Self {
        let (x0, y0) = (window.x0 / 4, window.y0 / 4);
        let columns = window.x1.div_ceil(4) - x0;
        let rows = window.y1.div_ceil(4) - y0;
        let mut grid = Self { x0, y0, columns, blocks: vec![None; (columns * rows) as usize] };
        for block in blocks {
            let [x, y] = block.origin;
            let place = (y / 4 - y0) * columns + x / 4 - x0;
            grid.blocks[place as usize] = Some(Placed::new(block));
        }
        grid
    }

    /// The block and the lane of an absolute pixel.
    fn at(&self, x: u32, y: u32) -> (Option<&Placed<'a>>, usize) {
        let block = (y / 4 - self.y0) * self.columns + x / 4 - self.x0;
        (self.blocks[block as usize].as_ref(), (y % 4 * 4 + x % 4) as usize)
    }

    /// Most nodes that a replicate has anywhere.
    fn slots(&self, r: u32) -> usize {
        self.blocks.iter().flatten().map(|placed| placed.count(r)).max().unwrap_or(0)
    }
}

/// The names of the channels of a node of a layer: how many samples, and of each colour the upper and
/// lower half.
fn names(layer: &str, r: u32, slot: usize) -> (String, [[String; 2]; 3]) {
    let prefix = format!("state.{layer}.r{r}.n{slot:02}");
    let sums = ["R", "G", "B"].map(|c| ["high", "low"].map(|half| format!("{prefix}.{c}.{half}")));
    (format!("{prefix}.count"), sums)
}

/// The names of what has sums: the radiance, and each layer that is a mean.
fn layer_names(wanted: &[Aov]) -> Vec<&'static str> {
    let means = Layers::means_of(wanted).into_iter().map(Aov::name);
    ["radiance"].into_iter().chain(means).collect()
}

/// The names of the channels of what a pixel shows in a Cryptomatte: id and count.
fn share_names(aov: Aov, place: usize) -> [String; 2] {
    ["id", "count"].map(|what| format!("state.{}.k{place:04}.{what}", aov.name()))
}

/// Writes a state. `attributes` say what it is the state of.
///
/// # Errors
/// [`WriteError`] where the file cannot be written; the old one is then untouched.
pub fn write_state(
    path: &Path,
    view: &StateView<'_>,
    mut attributes: Vec<Attribute>,
) -> Result<(), WriteError> {
    let window = view.film.window;
    let grid = &Grid::new(&window, view.blocks);
    type Value<'v> = Box<dyn Fn(&Placed<'_>, usize) -> u32 + Sync + 'v>;
    let row = |name: String, value: Value<'static>| {
        Channel::uint(name, move |[x, y], out| {
            for (x, out) in (window.x0 + x..).zip(out) {
                let (placed, lane) = grid.at(x, window.y0 + y);
                *out = placed.map_or(0, |placed| value(placed, lane));
            }
        })
    };
    let rgb = ["R", "G", "B"].map(str::to_owned);
    let mut channels: Vec<Channel> = Channel::of_plane(rgb, &view.film.mean, window.width()).into();
    let samples = |placed: &Placed<'_>, _| placed.block.sums.samples().end;
    channels.push(row("state.samples".to_owned(), Box::new(samples)));
    channels.push(row("state.target".to_owned(), Box::new(|placed, _| placed.block.target)));
    let layers = &view.film.layers;
    let replicates = (0..REPLICATES).flat_map(|r| (0..grid.slots(r)).map(move |slot| (r, slot)));
    let nodes = layer_names(&layers.wanted).into_iter().enumerate();
    for ((layer, of), (r, slot)) in
        nodes.flat_map(|layer| replicates.clone().map(move |node| (layer, node)))
    {
        let (count, sums) = names(of, r, slot);
        let of_count = move |placed: &Placed<'_>, lane: usize| {
            placed.node(layer, r, slot).map_or(0, |node| node.count[lane])
        };
        channels.push(row(count, Box::new(of_count)));
        for (c, halves) in sums.into_iter().enumerate() {
            for (name, shift) in halves.into_iter().zip([32, 0]) {
                let bits = move |placed: &Placed<'_>, lane: usize| {
                    let node = placed.node(layer, r, slot);
                    (node.map_or(0, |node| node.sum[c][lane].to_bits()) >> shift) as u32
                };
                channels.push(row(name, Box::new(bits)));
            }
        }
    }
    for (aov, pixels) in &layers.mattes {
        let most = pixels.iter().map(Vec::len).max().unwrap_or(0);
        for place in 0..most {
            let names = share_names(*aov, place);
            let share = move |pixel: usize| pixels[pixel].get(place).copied().unwrap_or_default();
            let first = move |x: u32, y: u32| y as usize * window.width() as usize + x as usize;
            let [id, count] = names;
            channels.push(Channel::uint(id, move |[x, y], out| {
                out.iter_mut().zip(first(x, y)..).for_each(|(out, i)| *out = share(i).0);
            }));
            channels.push(Channel::uint(count, move |[x, y], out| {
                let bits = |i| u32::from_ne_bytes(share(i).1.to_ne_bytes());
                out.iter_mut().zip(first(x, y)..).for_each(|(out, i)| *out = bits(i));
            }));
        }
    }
    channels.extend(center_channels(&layers.center, window.width()));
    let text = |name: &str, value| Attribute::new(name, AttributeValue::Text(value));
    attributes.extend([
        Attribute::new(VERSION.0, AttributeValue::Integer(VERSION.1)),
        text(FIRST, view.first_sample.to_string()),
        text(PASSED, view.passed.to_string()),
        text(RAYS, ray_text(view.rays)),
        text(NON_FINITE, non_finite_text(view.non_finite)),
        text(LAYERS, layers.wanted.iter().map(|aov| aov.name()).collect::<Vec<_>>().join(" ")),
    ]);
    let options = ExrOptions { compression: ExrCompression::Zips, ..ExrOptions::default() };
    write_channels(path, view.film.size, &window, channels, &attributes, &options).map(drop)
}

/// The header of a file of a state: what it says for us, and to all.
struct Head<'a> {
    path: &'a Path,
    read: ExrHead,
}

impl Head<'_> {
    fn unsound(&self, what: impl std::fmt::Display) -> ReadError {
        ReadError::file(self.path, format!("not a sound state: {what}"))
    }

    fn check(&self) -> Result<(), ReadError> {
        match self.read.attributes.iter().find(|a| a.name == VERSION.0) {
            Some(Attribute { value: AttributeValue::Integer(version), .. })
                if *version == VERSION.1 =>
            {
                Ok(())
            }
            Some(_) => Err(self.unsound("its format is of another version of alhazen")),
            None => {
                let message = "not a part or checkpoint of a render; accepted: what `alhazen \
                               render` wrote with --part or --checkpoint";
                Err(ReadError::file(self.path, message))
            }
        }
    }

    fn text(&self, name: &str) -> Result<&str, ReadError> {
        let found = self.read.attributes.iter().find(|a| a.name == name);
        match found.map(|a| &a.value) {
            Some(AttributeValue::Text(text)) => Ok(text.as_str()),
            _ => Err(self.unsound(format!("the attribute {name} is missing"))),
        }
    }

    fn number(&self, name: &str) -> Result<u32, ReadError> {
        let parsed = self.text(name)?.parse();
        parsed.map_err(|_| self.unsound(format!("the attribute {name} is no number")))
    }

    fn window(&self) -> Result<PixelRect, ReadError> {
        window_of(self.read.origin, self.read.extent).ok_or_else(|| self.unsound("its window"))
    }

    /// What it says of the render, and not of how far that is.
    fn others(&self) -> Vec<Attribute> {
        let is_ours = |a: &Attribute| a.name.starts_with(VERSION.0);
        self.read.attributes.iter().filter(|a| !is_ours(a)).cloned().collect()
    }
}

/// Reads what a file that [`write_state`] wrote says of itself, without its sums.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, or is no state.
pub fn read_state_head(path: &Path) -> Result<StateHead, ReadError> {
    let head = Head { path, read: read_head(path)? };
    head.check()?;
    Ok(StateHead {
        size: head.read.size,
        window: head.window()?,
        samples: head.number(FIRST)?..head.number(PASSED)?,
        attributes: head.others(),
    })
}

/// Reads a state that [`write_state`] wrote.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, or holds no sound state.
pub fn read_state(path: &Path) -> Result<StateFile, ReadError> {
    let (read, channels) = read_channels(path)?;
    let head = Head { path, read };
    head.check()?;
    let unsound = |what: &str| head.unsound(what);
    let first_sample = head.number(FIRST)?;
    let passed = head.number(PASSED)?;
    let text = |name: &str| head.text(name);
    let rays = parse_rays(text(RAYS)?).ok_or_else(|| unsound("its numbers of rays"))?;
    let non_finite = parse_non_finite(text(NON_FINITE)?).ok_or_else(|| unsound(NON_FINITE))?;

    let layers: Option<Vec<Aov>> = text(LAYERS)?
        .split_whitespace()
        .map(|name| Aov::ALL.into_iter().find(|aov| aov.name() == name))
        .collect();
    let layers = layers.ok_or_else(|| unsound("its layers"))?;

    let window = head.window()?;
    let plane = |name: &str| {
        let found = channels.iter().find(|(n, _)| n == name);
        found.map(|(_, values)| values.as_slice())
    };
    let need =
        |name: &str| plane(name).ok_or_else(|| unsound(&format!("the channel {name} is missing")));
    let (samples, targets) = (need("state.samples")?, need("state.target")?);
    // By layer, replicate and slot: the planes of a node.
    let mut planes = Vec::new();
    for (of, r) in
        layer_names(&layers).into_iter().flat_map(|of| (0..REPLICATES).map(move |r| (of, r)))
    {
        let mut slots = Vec::new();
        for slot in 0..MOST_NODES {
            let (count, sums) = names(of, r, slot);
            let Some(count) = plane(&count) else { break };
            let mut halves = [[[0u32; 0].as_slice(); 2]; 3];
            for (to, name) in halves.as_flattened_mut().iter_mut().zip(sums.as_flattened()) {
                *to = need(name)?;
            }
            slots.push((count, halves));
        }
        planes.push(slots);
    }
    let index = |x: u32, y: u32| {
        let inside = window.contains(x, y);
        inside
            .then(|| (y - window.y0) as usize * window.width() as usize + (x - window.x0) as usize)
    };
    let block = |origin: [u32; 2]| {
        let lanes: [Option<usize>; BLOCK_LANES] = std::array::from_fn(|lane| {
            index(origin[0] + lane as u32 % 4, origin[1] + lane as u32 / 4)
        });
        let any = lanes.iter().flatten().copied().next()?;
        let range = first_sample..samples[any];
        if range.start > range.end || targets[any] < range.end {
            return None;
        }
        let mut of_layers = Vec::new();
        for replicates in planes.chunks(REPLICATES as usize) {
            let mut list = Vec::new();
            for (r, slots) in (0..).zip(replicates) {
                let count = BlockSums::nodes_of_replicate(&range, r, REPLICATES);
                for (count, sums) in slots.get(..count)? {
                    let mut node = SumNode::EMPTY;
                    for (lane, pixel) in lanes.iter().enumerate() {
                        let Some(pixel) = *pixel else { continue };
                        node.count[lane] = count[pixel];
                        for (sum, [high, low]) in node.sum.iter_mut().zip(sums) {
                            let bits = u64::from(high[pixel]) << 32 | u64::from(low[pixel]);
                            sum[lane] = f64::from_bits(bits);
                        }
                    }
                    list.push(node);
                }
            }
            of_layers.push(BlockSums::from_nodes(range.clone(), REPLICATES, list)?);
        }
        let sums = of_layers.remove(0);
        Some(BlockState { origin, target: targets[any], sums, layers: of_layers })
    };
    let blocks: Option<Vec<BlockState>> = block_origins(&window).map(block).collect();
    let blocks = blocks.ok_or_else(|| unsound("sums are missing"))?;
    let mattes = Layers::mattes_of(&layers).into_iter().map(|aov| {
        let mut pixels = vec![Shares::new(); window.area()];
        for place in 0.. {
            let [id, count] = share_names(aov, place);
            let Some((ids, counts)) = plane(&id).zip(plane(&count)) else { break };
            for (pixel, (id, count)) in pixels.iter_mut().zip(ids.iter().zip(counts)) {
                let count = i32::from_ne_bytes(count.to_ne_bytes());
                if count != 0 {
                    add_share(pixel, *id, count);
                }
            }
        }
        (aov, pixels)
    });
    let mattes = mattes.collect();
    let center = center_from(plane);
    let state =
        RenderState { window, first_sample, passed, blocks, rays, non_finite, layers, mattes };
    Ok(StateFile { size: head.read.size, state, center, attributes: head.others() })
}

fn window_of(origin: [i32; 2], extent: [u32; 2]) -> Option<PixelRect> {
    let [x0, y0] = origin.map(|x| u32::try_from(x).ok());
    let (x0, y0) = (x0?, y0?);
    Some(PixelRect { x0, y0, x1: x0.checked_add(extent[0])?, y1: y0.checked_add(extent[1])? })
}

fn ray_text(rays: &RayCounts) -> String {
    let numbers = [
        rays.camera,
        rays.shadow,
        rays.reflection,
        rays.refraction,
        rays.diffuse,
        rays.ends.miss,
        rays.ends.diffuse,
        rays.ends.depth,
        rays.ends.prune,
        rays.ends.roulette,
    ];
    numbers.map(|n| n.to_string()).join(" ")
}

fn parse_rays(text: &str) -> Option<RayCounts> {
    let numbers: Vec<u64> = text.split(' ').map(|n| n.parse().ok()).collect::<Option<_>>()?;
    let [
        camera,
        shadow,
        reflection,
        refraction,
        diffuse,
        miss,
        ends_diffuse,
        depth,
        prune,
        roulette,
    ] = numbers.try_into().ok()?;
    let ends = BranchEnds { miss, diffuse: ends_diffuse, depth, prune, roulette };
    Some(RayCounts { camera, shadow, reflection, refraction, diffuse, ends })
}

/// How many, and then pixel and number of each that is told.
fn non_finite_text(found: &NonFinite) -> String {
    let told = found.first.iter().map(|([x, y], sample)| format!(" {x},{y},{sample}"));
    format!("{}{}", found.count, told.collect::<String>())
}

fn parse_non_finite(text: &str) -> Option<NonFinite> {
    let mut words = text.split(' ');
    let count = words.next()?.parse().ok()?;
    let first = words.map(|word| {
        let numbers: Vec<u32> = word.split(',').map(|n| n.parse().ok()).collect::<Option<_>>()?;
        let [x, y, sample] = numbers.try_into().ok()?;
        Some(([x, y], sample))
    });
    Some(NonFinite { count, first: first.collect::<Option<_>>()? })
}
