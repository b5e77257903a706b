//! A textured board to print: watertight mesh, height field, and what a finger meets on it.
//!
//! `cargo run --release --example texture_patch -- --stl patch.stl --out figures`

use clap::Parser;
use hwall_lab::texture::patch::{self, Grid, Request, Shape};
use hwall_lab::texture::wanted::WantedArgs;
use hwall_stage::{exit, printed};
use std::path::PathBuf;
use std::process::ExitCode;

/// Designs a patch of bumps and writes it as a closed solid.
///
/// Prints what the mesh is (triangles, watertight or not, chord error measured on it, volume against the
/// exact one), what a printer cannot make of it, and for each orientation of the scan the width w, the
/// spacing d, the mean distance of encounters and their frequency over speed. Angles are from the long axis
/// of the bumps.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    wanted: WantedArgs,
    /// released, study-1.5, study-2, study-2.5, study-3, spaced-3 (text of the dissertation), or long radius, short radius,
    /// height, long pitch, short pitch in mm: RX,RY,H,PX,PY
    #[arg(long, default_value = "released", conflicts_with = "wished")]
    preset: String,
    /// Size in mm, one number or X,Y [default: 200 for the released patch, else 50]
    #[arg(long, value_delimiter = ',', num_args = 1..=2, allow_negative_numbers = true)]
    size_mm: Vec<f64>,
    /// Largest distance of the mesh from the true surface, micrometres, 1 to 1000
    #[arg(long, default_value_t = 10.0, allow_negative_numbers = true)]
    accuracy_um: f64,
    /// Allow triangles on both sides of the surface within the accuracy: half as many (ellipsoids)
    #[arg(long)]
    both_sides: bool,
    /// Shape of the bumps
    #[arg(long, value_enum, default_value_t = Shape::Ellipsoid)]
    texton: Shape,
    /// How the bumps stand; staggered moves every second row by half the long pitch
    #[arg(long, value_enum, default_value_t = Grid::Rectangular)]
    layout: Grid,
    /// Thickness of the plate, mm
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    plate_mm: f64,
    /// Mounting hole X,Y,DIAMETER in mm; may be repeated
    #[arg(long)]
    hole: Vec<String>,
    /// Size of the tiles in mm, one number or X,Y; no bump crosses their borders
    #[arg(long, value_delimiter = ',', num_args = 1..=2, default_value = "100", allow_negative_numbers = true)]
    tile_mm: Vec<f64>,
    /// Continue the grid across tiles instead of starting it anew on each
    #[arg(long)]
    continuous: bool,
    /// Write meshes and pictures of each tile (NAME-1.stl, ...) instead of the whole
    #[arg(long)]
    tiles: bool,
    /// Write the mesh as STL
    #[arg(long)]
    stl: Option<PathBuf>,
    /// STL as text
    #[arg(long, requires = "stl")]
    ascii: bool,
    /// Write the mesh as OBJ
    #[arg(long)]
    obj: Option<PathBuf>,
    /// Write the heights as EXR, and normals beside it as NAME-normals.exr
    #[arg(long)]
    exr: Option<PathBuf>,
    /// Distance of the pixels, micrometres
    #[arg(long, default_value_t = 100.0, allow_negative_numbers = true)]
    pixel_um: f64,
    /// Folder for figures: the patch from above and from the side, spacing and width over orientation
    #[arg(long)]
    out: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit(run(hwall_stage::arguments::<Args>()))
}

fn run(args: Args) -> anyhow::Result<()> {
    let request = Request {
        wanted: args.wanted,
        preset: args.preset,
        size_mm: args.size_mm,
        accuracy_mm: 1e-3 * args.accuracy_um,
        both_sides: args.both_sides,
        shape: args.texton,
        grid: args.layout,
        plate_mm: args.plate_mm,
        holes: args.hole,
        tile_mm: args.tile_mm,
        restart: !args.continuous,
        by_tile: args.tiles,
        stl: args.stl,
        ascii: args.ascii,
        obj: args.obj,
        exr: args.exr,
        pixel_mm: 1e-3 * args.pixel_um,
        figures: args.out,
    };
    printed(|out| patch::run(&request, out))
}
