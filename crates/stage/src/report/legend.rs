//! The legend beside the plan, one row per symbol.

use crate::report::figure::{Area, Draw};
use crate::report::figures::{COLOURS, TEXT};
use crate::run::logs::trace::TouchMark;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A place in the whole picture.
pub(super) type Pixel = (i32, i32);

/// Height of a row, width of its sign and distance of its text from the left, pixels.
const ROW_PX: i32 = 22;
const SIGN_PX: i32 = 30;
const TEXT_PX: i32 = 40;

/// Draws symbols and their names, in pixels of the whole picture; also used for symbols in the drawing.
pub(super) struct Legend<'a> {
    pub(super) area: Area<'a>,
    /// Left end, and middle of the next row.
    pub(super) x: i32,
    pub(super) y: i32,
}

impl Legend<'_> {
    /// A heading for the rows below.
    pub(super) fn heading(&mut self, text: &str) -> anyhow::Result<()> {
        self.y += ROW_PX / 2;
        let style = TextStyle::from((TEXT.0, TEXT.1, FontStyle::Bold)).color(&BLACK);
        self.label(text, 0, &style)
    }

    /// A sentence without a symbol.
    pub(super) fn text(&mut self, text: &str) -> anyhow::Result<()> {
        let grey = BLACK.mix(0.7);
        let style = TextStyle::from((TEXT.0, TEXT.1 - 2)).color(&grey);
        self.label(text, 0, &style)
    }

    pub(super) fn line(&mut self, style: ShapeStyle, name: &str) -> anyhow::Result<()> {
        self.path(&[self.sign(0), self.sign(SIGN_PX)], style)?;
        self.name(name)
    }

    pub(super) fn dashes(&mut self, style: ShapeStyle, name: &str) -> anyhow::Result<()> {
        for from in [0, 12, 24] {
            self.path(&[self.sign(from), self.sign(from + 6)], style)?;
        }
        self.name(name)
    }

    pub(super) fn dots(&mut self, style: ShapeStyle, name: &str) -> anyhow::Result<()> {
        for x in [8, 15, 22] {
            self.circle(self.sign(x), 2, style)?;
        }
        self.name(name)
    }

    /// Links of the arm with the board at their end.
    pub(super) fn linkage(
        &mut self,
        link: RGBAColor,
        face: RGBAColor,
        name: &str,
    ) -> anyhow::Result<()> {
        let (base, end) = (self.sign(3), self.sign(SIGN_PX - 2));
        self.path(&[base, end], link.stroke_width(3))?;
        self.ring(base, link)?;
        self.path(
            &[(end.0, end.1 - 8), (end.0, end.1 + 8)],
            face.stroke_width(5),
        )?;
        self.name(name)
    }

    /// A board alone.
    pub(super) fn board(&mut self, face: RGBAColor, name: &str) -> anyhow::Result<()> {
        let (middle, tip) = (self.sign(8), self.sign(22));
        let style = face.stroke_width(2);
        self.path(&[(middle.0, middle.1 - 8), (middle.0, middle.1 + 8)], style)?;
        self.path(&[middle, tip], style)?;
        let (x, y) = tip;
        self.path(&[(x - 5, y - 3), tip, (x - 5, y + 3)], style)?;
        self.name(name)
    }

    /// The base of the arm.
    pub(super) fn base(&mut self, name: &str) -> anyhow::Result<()> {
        self.cross(self.sign(SIGN_PX / 2), 6, BLACK.stroke_width(3))?;
        self.name(name)
    }

    /// The outcome of touches.
    pub(super) fn touch(&mut self, mark: TouchMark, name: &str) -> anyhow::Result<()> {
        self.mark(self.sign(SIGN_PX / 2), mark)?;
        self.name(name)
    }

    /// The symbol of a touch: full, crossed or hollow; differs in shape and colour.
    pub(super) fn mark(&self, at: Pixel, mark: TouchMark) -> anyhow::Result<()> {
        let [_, _, green, pink, _, _, grey] = COLOURS;
        match mark {
            TouchMark::InPlace => {
                self.circle(at, 6, WHITE.filled())?;
                self.circle(at, 5, green.filled())
            }
            TouchMark::Late => {
                self.cross(at, 6, WHITE.stroke_width(6))?;
                self.cross(at, 5, pink.stroke_width(3))
            }
            TouchMark::OutOfReach => {
                self.circle(at, 5, WHITE.filled())?;
                self.circle(at, 5, grey.stroke_width(2))
            }
        }
    }

    /// A joint of the arm.
    pub(super) fn ring(&self, at: Pixel, colour: RGBAColor) -> anyhow::Result<()> {
        self.circle(at, 4, WHITE.filled())?;
        self.circle(at, 4, colour.stroke_width(2))
    }

    pub(super) fn cross(&self, at: Pixel, size: i32, style: ShapeStyle) -> anyhow::Result<()> {
        self.area.put(&Cross::new(at, size, style))
    }

    fn circle(&self, at: Pixel, radius: i32, style: ShapeStyle) -> anyhow::Result<()> {
        self.area.put(&Circle::new(at, radius, style))
    }

    fn path(&self, points: &[Pixel], style: ShapeStyle) -> anyhow::Result<()> {
        self.area.put(&PathElement::new(points.to_vec(), style))
    }

    /// A point of the current row, `x` from its left end.
    const fn sign(&self, x: i32) -> Pixel {
        (self.x + x, self.y)
    }

    /// Ends a row.
    fn name(&mut self, text: &str) -> anyhow::Result<()> {
        let style = TextStyle::from(TEXT).color(&BLACK);
        self.label(text, TEXT_PX, &style)
    }

    fn label(&mut self, text: &str, x: i32, style: &TextStyle<'_>) -> anyhow::Result<()> {
        let style = style.pos(Pos::new(HPos::Left, VPos::Center));
        self.area.write(text, style, self.sign(x))?;
        self.y += ROW_PX;
        Ok(())
    }
}
