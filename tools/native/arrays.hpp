// SPDX-License-Identifier: BSD-3-Clause
// NumPy arrays in and out of the module.
//
// Units    of the caller.
// Frames   of the caller.
// Arrays   C order.
// Memory   results are owned by Python.
// Errors   none.
#ifndef LEEWAY_NATIVE_ARRAYS_HPP
#define LEEWAY_NATIVE_ARRAYS_HPP

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <functional> // multiplies
#include <memory>     // unique_ptr
#include <numeric>    // accumulate
#include <utility>    // move
#include <vector>

using Input = nanobind::ndarray<const double, nanobind::c_contig, nanobind::device::cpu>;
template <typename T> using Output = nanobind::ndarray<nanobind::numpy, T, nanobind::c_contig>;

// A new array that owns its memory.
template <typename T> struct Owned {
    std::vector<size_t> shape;
    std::unique_ptr<T[]> data;

    explicit Owned(std::vector<size_t> dimensions)
        : shape(std::move(dimensions)),
          data(new T[std::accumulate(shape.begin(), shape.end(), size_t{1}, std::multiplies<>())]())
    {
    }

    Output<T> release()
    {
        T *values = data.release();
        nanobind::capsule owner(values, [](void *p) noexcept { delete[] static_cast<T *>(p); });
        return Output<T>(values, shape.size(), shape.data(), owner);
    }
};

#endif
