use super::*;
use crate::joint::cells::RowMaps;
use crate::joint::photometry::edge::{Edge, RATIOS};

/// The choice of the pixels, and the share of them that take another place.
fn choose(edge: &Edge, noise: f32) -> (Choice, f32) {
    let (lit, modulation) = (edge.plane(1.0), edge.plane(0.2));
    let mut choice = Choice::default();
    choice.make(&edge.maps, &edge.scene(&lit), RATIOS, [&edge.phase, &modulation], noise);
    let moved = choice.places.iter().filter(|place| **place != 0).count();
    let share = moved as f32 / choice.places.len() as f32;
    (choice, share)
}

/// Greatest difference from the texture of the pixel, with the values at its position and with the chosen ones. Pixels next
/// to the edge are left out, because their neighbours belong to both textures.
fn errors(edge: &Edge, choice: &Choice) -> [f32; 2] {
    let mut rows = RowMaps::default();
    let mut sampled = rows.sample_mut::<8>(&edge.grid, &edge.maps, 0, 30);
    let error = |rows: &[&mut [f32]; 8]| {
        let off = |x: usize, k: usize| (rows[k][x] - edge.texture(x)[k]).abs();
        (20..236)
            .filter(|x| !(127..130).contains(x))
            .flat_map(|x| (0..8).map(move |k| off(x, k)))
            .fold(0.0, f32::max)
    };
    let here = error(&sampled);
    choice.apply(&edge.grid, &edge.maps, 30, &mut sampled);
    [here, error(&sampled)]
}

#[test]
fn pixels_near_an_edge_take_offsets_and_amplitudes_of_their_side() {
    let textures = [[0.5, 0.4, 0.2, 0.15, 0.6, 0.45, 0.4, 0.35], [0.3, 0.25, 0.5, 0.4, 0.2, 0.15, 0.4, 0.3]];
    let edge = Edge::new(textures, 0.0);
    let (choice, share) = choose(&edge, 1e-3);
    let [here, chosen] = errors(&edge, &choice);
    assert!(here > 0.1, "{here}");
    assert!(chosen < 0.02, "{chosen}");
    // At their position these pixels have a mixture of both textures, so they take no part in the next fit.
    let mut usable = vec![1.0; 256];
    choice.leave_out(30, &mut usable);
    let left_out: Vec<usize> = (0..256).filter(|&x| usable[x] == 0.0).collect();
    assert!(left_out.iter().all(|x| (112..144).contains(x)), "{left_out:?}");
    assert!((118..138).filter(|x| !(127..130).contains(x)).all(|x| left_out.contains(&x)), "{left_out:?}");
    assert!((0.04..0.13).contains(&share), "{share}");
}

#[test]
fn residuals_that_noise_explains_move_no_pixel() {
    let textures = [[0.5, 0.4, 0.5, 0.4, 0.5, 0.4, 0.5, 0.4], [0.5, 0.4, 0.5, 0.4, 0.5, 0.4, 0.5, 0.39]];
    let edge = Edge::new(textures, 0.0);
    let (choice, share) = choose(&edge, 0.03);
    let [here, chosen] = errors(&edge, &choice);
    assert_eq!(here, chosen);
    assert_eq!(share, 0.0);
}
