"""Render units: functions of one ray, compiled for SIMD lanes and CUDA threads.

A docstring lists the names that are a function's own. All others mean the same everywhere:

==================== ==================================================================================
``P``                parameters of the scene
``px, py``           position on the film, pixels
``lens_u, lens_v``   random numbers in [0, 1) for the lens
``eye``              position of the camera
``ox, oy, oz``       origin of the ray
``dx, dy, dz``       unit direction of the ray
``t, path, steps``   distance along the ray, length of the path before it, steps so far
``before, stride``   radius of the previous ball, step taken from its centre
``steepness``        reciprocal of the field's Lipschitz bound
``side``             1 outside the solid, -1 inside
``x, y, z``          point of the surface, scene units
``nx, ny, nz``       unit normal
``lx, ly, lz``       unit direction to the light
``u, v``             random numbers in [0, 1)
``r, g, b, c``       linear light: red, green, blue, one of them
``rough``            roughness, 0 to 1; 0 for a mirror
``share``            probability of reflection
``cosine``           cosine of the angle of incidence
``dense``            density of a sample; all densities are per unit solid angle
``width, height``    size of a picture, pixels
==================== ==================================================================================
"""
