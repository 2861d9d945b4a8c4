//! What a picture may hold beside its colours (AOVs, arbitrary output variables): which there are, and
//! their planes.

use crate::color::Rgb;

/// A layer of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Aov {
    /// Share of light that the first surface scatters; mean over samples.
    Albedo,
    /// Geometric normal of the first surface on the viewer's side; mean over samples.
    Normal,
    /// Its shading normal, bent by interpolation and maps; mean over samples.
    ShadingNormal,
    /// Light that reaches the camera from the first surface, of its own or straight from lights; mean.
    Direct,
    /// All other light.
    Indirect,
    /// Distance along the view to what the middle of the pixel shows.
    Depth,
    /// Position of that, in the scene's coordinates.
    Position,
    /// Its texture coordinates.
    Uv,
    /// Number of its object, from 1; 0 where there is none.
    ObjectId,
    /// Number of its material, from 1 (the default one); 0 where there is none.
    MaterialId,
    /// Samples of the pixel.
    Samples,
    /// Variance of the pixel's mean.
    Variance,
    /// Cryptomatte of objects.
    CryptoObject,
    /// Cryptomatte of materials.
    CryptoMaterial,
}

impl Aov {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Albedo,
        Self::Normal,
        Self::ShadingNormal,
        Self::Direct,
        Self::Indirect,
        Self::Depth,
        Self::Position,
        Self::Uv,
        Self::ObjectId,
        Self::MaterialId,
        Self::Samples,
        Self::Variance,
        Self::CryptoObject,
        Self::CryptoMaterial,
    ];

    /// The name on the command line, and of the layer in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::ShadingNormal => "shading_normal",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Depth => "depth",
            Self::Position => "position",
            Self::Uv => "uv",
            Self::ObjectId => "object_id",
            Self::MaterialId => "material_id",
            Self::Samples => "samples",
            Self::Variance => "variance",
            Self::CryptoObject => "crypto_object",
            Self::CryptoMaterial => "crypto_material",
        }
    }

    /// Whether it is the mean over samples of three values of each.
    pub const fn is_mean(self) -> bool {
        matches!(self, Self::Albedo | Self::Normal | Self::ShadingNormal | Self::Direct)
    }

    /// Whether it is of what the middle of the pixel shows: a mean would lie on neither of two surfaces.
    pub const fn is_of_center(self) -> bool {
        matches!(self, Self::Depth | Self::Position | Self::Uv | Self::ObjectId | Self::MaterialId)
    }

    /// Whether it is a Cryptomatte.
    pub const fn is_matte(self) -> bool {
        matches!(self, Self::CryptoObject | Self::CryptoMaterial)
    }
}

/// What a pixel shows shares of: ids, and the weight of the samples that showed them, counted. Weights of
/// the film's samples differ in nothing but their sign.
pub type Shares = Vec<(u32, i32)>;

/// Adds to shares, which stay in the order of ids.
pub fn add_share(shares: &mut Shares, id: u32, count: i32) {
    match shares.binary_search_by_key(&id, |(id, _)| *id) {
        Ok(at) => shares[at].1 += count,
        Err(at) => shares.insert(at, (id, count)),
    }
}

/// What the middles of pixels show, row by row over the window. A plane that was not asked for is empty.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CenterLayers {
    /// Distance along the view, in metres; 1e10 where there is nothing.
    pub depth: Vec<f32>,
    /// Positions in the scene's coordinates; 0 where there is nothing.
    pub position: Vec<[f32; 3]>,
    /// Texture coordinates; 0 where there are none.
    pub uv: Vec<[f32; 2]>,
    /// Numbers of objects.
    pub object_id: Vec<f32>,
    /// Numbers of materials.
    pub material_id: Vec<f32>,
}

/// The layers of a picture, row by row over its window.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layers {
    /// What was asked for, in the order of [`Aov::ALL`].
    pub wanted: Vec<Aov>,
    /// Means over samples.
    pub means: Vec<(Aov, Vec<Rgb>)>,
    /// Cryptomattes: by pixel, the ids that it shows.
    pub mattes: Vec<(Aov, Vec<Shares>)>,
    /// Samples of each pixel; empty where not asked for.
    pub samples: Vec<u32>,
    /// What the middles of pixels show.
    pub center: CenterLayers,
}

impl Layers {
    /// Empty planes for what is wanted, of so many pixels.
    pub fn new(wanted: &[Aov], pixels: usize) -> Self {
        let mut wanted = wanted.to_vec();
        wanted.sort_unstable();
        wanted.dedup();
        let plane = |aov| (aov, vec![Rgb::BLACK; pixels]);
        let matte = |aov| (aov, vec![Shares::new(); pixels]);
        Self {
            means: Self::means_of(&wanted).into_iter().map(plane).collect(),
            mattes: Self::mattes_of(&wanted).into_iter().map(matte).collect(),
            samples: if wanted.contains(&Aov::Samples) { vec![0; pixels] } else { Vec::new() },
            center: CenterLayers::default(),
            wanted,
        }
    }

    /// The means over samples that are needed for what is wanted.
    pub fn means_of(wanted: &[Aov]) -> Vec<Aov> {
        // Indirect light is what is not direct.
        let needs = |aov: &Aov| {
            wanted.contains(aov) || (*aov == Aov::Direct && wanted.contains(&Aov::Indirect))
        };
        Aov::ALL.into_iter().filter(|aov| aov.is_mean() && needs(aov)).collect()
    }

    /// The Cryptomattes among what is wanted.
    pub fn mattes_of(wanted: &[Aov]) -> Vec<Aov> {
        Aov::ALL.into_iter().filter(|aov| aov.is_matte() && wanted.contains(aov)).collect()
    }

    /// A mean over samples.
    pub fn mean(&self, aov: Aov) -> Option<&[Rgb]> {
        self.means.iter().find(|(of, _)| *of == aov).map(|(_, plane)| plane.as_slice())
    }
}
