// The extension module fracslice._native. Its Python face and its documentation are in ../_native.pyi.
#include <nanobind/nanobind.h>

namespace fracslice::volume {
void bind_extent(nanobind::module_& module);
void bind_signs(nanobind::module_& module);
}  // namespace fracslice::volume

namespace fracslice::mesh {
void bind_contour(nanobind::module_& module);
void bind_mesh(nanobind::module_& module);
void bind_reduction(nanobind::module_& module);
}  // namespace fracslice::mesh

namespace fracslice::printing {
void bind_printing(nanobind::module_& module);
}  // namespace fracslice::printing

NB_MODULE(_native, module) {
    nanobind::set_leak_warnings(false);  // the command exits without a search for garbage
    fracslice::volume::bind_extent(module);
    fracslice::volume::bind_signs(module);
    fracslice::mesh::bind_contour(module);
    fracslice::mesh::bind_mesh(module);
    fracslice::mesh::bind_reduction(module);
    fracslice::printing::bind_printing(module);
}
