"""Distance fields: scene trees and what is computed of them: boxes, bounds, orbits, kernels."""
