//! What a picture can hold besides radiance, one layer each.

/// Element or face of pixels that see none.
pub const NOTHING: u32 = u32::MAX;

/// A layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, clap::ValueEnum)]
pub enum Layer {
    /// Diffuse reflectance, RGB
    Albedo,
    /// Unit normal of the side that is seen, in the scene's axes
    Normal,
    /// Distance along the view, in a panorama from the eye
    Depth,
    /// Element that covers most of the pixel, 4294967295 for none
    Element,
    /// Input face of that element
    Face,
    /// Irradiance, RGB, W m^-2
    Irradiance,
    /// Radiance by light that came straight from lamps, their own included
    Direct,
    /// Radiance by light that was reflected before
    Indirect,
    /// Estimated error of radiance by interpolation, W m^-2 sr^-1
    Error,
}

impl Layer {
    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Albedo => "albedo",
            Layer::Normal => "normal",
            Layer::Depth => "depth",
            Layer::Element => "element",
            Layer::Face => "face",
            Layer::Irradiance => "irradiance",
            Layer::Direct => "direct",
            Layer::Indirect => "indirect",
            Layer::Error => "error",
        }
    }

    /// Names of the layer's channels, after the layer's own name and a dot.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Layer::Albedo | Layer::Irradiance | Layer::Direct | Layer::Indirect => &["R", "G", "B"],
            Layer::Normal => &["X", "Y", "Z"],
            Layer::Depth => &["Z"],
            Layer::Element | Layer::Face => &["id"],
            Layer::Error => &["V"],
        }
    }

    /// Whether it needs light apart by where it comes from, which a solution's elements do not have.
    pub fn needs_gathering(self) -> bool {
        matches!(self, Layer::Direct | Layer::Indirect | Layer::Error)
    }
}

/// Values of a layer, pixel by pixel.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Three numbers.
    Triples(Vec<[f64; 3]>),
    /// One number.
    Numbers(Vec<f64>),
    /// An index.
    Indices(Vec<u32>),
}

/// All that is known of a pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pixel {
    /// Mean radiance.
    pub radiance: [f64; 3],
    /// Mean reflectance of what is seen.
    pub albedo: [f64; 3],
    /// Mean normal.
    pub normal: [f64; 3],
    /// Mean depth of the element seen most.
    pub depth: f64,
    /// Element seen most.
    pub element: u32,
    /// Its input face.
    pub face: u32,
    /// Mean irradiance.
    pub irradiance: [f64; 3],
    /// Mean radiance by light from lamps.
    pub direct: [f64; 3],
    /// Mean radiance by reflected light.
    pub indirect: [f64; 3],
    /// Mean estimated error of radiance.
    pub error: f64,
    /// Part of the pixel where a lamp is seen.
    pub lamp_share: f64,
    /// What that part adds to the radiance.
    pub lamp_radiance: [f64; 3],
}

impl Layer {
    /// The layer out of all that is known.
    pub fn of(self, pixels: &[Pixel]) -> Values {
        let triples = |pick: fn(&Pixel) -> [f64; 3]| Values::Triples(pixels.iter().map(pick).collect());
        match self {
            Layer::Albedo => triples(|p| p.albedo),
            Layer::Normal => triples(|p| p.normal),
            Layer::Irradiance => triples(|p| p.irradiance),
            Layer::Direct => triples(|p| p.direct),
            Layer::Indirect => triples(|p| p.indirect),
            Layer::Depth => Values::Numbers(pixels.iter().map(|p| p.depth).collect()),
            Layer::Error => Values::Numbers(pixels.iter().map(|p| p.error).collect()),
            Layer::Element => Values::Indices(pixels.iter().map(|p| p.element).collect()),
            Layer::Face => Values::Indices(pixels.iter().map(|p| p.face).collect()),
        }
    }
}

impl Values {
    /// Adds those of further pixels of the same layer.
    pub fn append(&mut self, more: Values) {
        match (self, more) {
            (Values::Triples(all), Values::Triples(more)) => all.extend(more),
            (Values::Numbers(all), Values::Numbers(more)) => all.extend(more),
            (Values::Indices(all), Values::Indices(more)) => all.extend(more),
            (all, more) => debug_assert!(false, "{all:?} and {more:?} are of different layers"),
        }
    }
}
