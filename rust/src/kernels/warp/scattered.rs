//! Scattered points: the Delaunay triangulation of the sources, drawn at the targets.

use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::raster::{Triangle, bands};
use super::{Point, Warped};
use crate::foundation::par::Monitor;
use crate::{Error, Result};

/// Maximum absolute coordinate, far beyond the size of any output.
const FAR: f64 = 1e7;

struct Vertex {
    at: Point,
    number: usize,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        Point2::new(self.at[1], self.at[0])
    }
}

/// Warps `source` points to `target`, into an output of `shape`. Also returns the corners of the
/// triangles.
pub fn scattered(
    source: &[Point],
    target: &[Point],
    shape: [usize; 2],
    monitor: &Monitor,
) -> Result<(Warped, Vec<[u32; 3]>)> {
    if source.len() != target.len() {
        return Err(Error::Shape {
            argument: "target",
            expected: vec![source.len(), 2],
            got: vec![target.len(), 2],
        });
    }
    for (argument, points) in [("source", source), ("target", target)] {
        if let Some(p) = points
            .iter()
            .flatten()
            .find(|x| x.is_nan() || x.abs() > FAR)
        {
            return Err(Error::value(
                argument,
                format!("coordinates must be finite and within 10^7 of zero, got {p}"),
            ));
        }
    }
    // Triangulate the sources. Duplicate points are an error.
    let mut triangulation = DelaunayTriangulation::<Vertex>::new();
    for (number, &at) in source.iter().enumerate() {
        let before = triangulation.num_vertices();
        triangulation.insert(Vertex { at, number }).map_err(|e| {
            Error::value(
                "source",
                format!("cannot insert point {number} at {at:?}: {e}"),
            )
        })?;
        if triangulation.num_vertices() == before {
            return Err(Error::value(
                "source",
                format!("points must differ, got two at the same place {at:?}"),
            ));
        }
        if number % 1024 == 0 {
            monitor.check()?;
        }
    }
    // Sort the triangles, so that their order does not depend on the triangulation.
    let mut corners: Vec<[u32; 3]> = triangulation
        .inner_faces()
        .map(|face| {
            let mut three = face.vertices().map(|v| v.data().number as u32);
            let first = (0..3).min_by_key(|&k| three[k]).unwrap_or(0);
            three.rotate_left(first);
            three
        })
        .collect();
    corners.sort_unstable();
    if corners.is_empty() {
        return Err(Error::value(
            "source",
            format!(
                "must contain three points that are not on a line, got {} points",
                source.len()
            ),
        ));
    }
    let triangles: Vec<Triangle> = corners
        .iter()
        .map(|three| Triangle {
            target: three.map(|i| target[i as usize]),
            source: three.map(|i| source[i as usize]),
            weight: 0,
        })
        .collect();
    let (places, triangle) = bands(shape, monitor, |band| {
        for (number, t) in triangles.iter().enumerate() {
            band.draw(number as u32 + 1, t);
        }
    })?;
    let flipped = triangles.iter().filter(|t| t.turned()).count();
    let warped = Warped {
        places,
        triangle,
        drawn: triangles.len(),
        flipped,
        flipped_heavy: 0,
    };
    Ok((warped, corners))
}
