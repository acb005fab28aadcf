// SPDX-License-Identifier: BSD-3-Clause
// Scene for Python.
//
// Units    metres, radians, seconds, Hz.
// Frames   base frame of the arm.
// Arrays   lists of numbers.
// Memory   see scene.hpp.
// Errors   see scene.hpp.
#include "scene.hpp"

#include <cstdio>    // open_memstream
#include <cstdlib>   // free
#include <cstring>   // memcpy
#include <stdexcept> // invalid_argument

namespace nb = nanobind;

namespace
{

template <typename T> T load(const unsigned char *at)
{
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
}

// `root` is the whole scene, where the pool of numbers lies.
nb::dict section(const lw_key *keys, const unsigned char *at, const unsigned char *root);

nb::list numbers(const unsigned char *at, int count)
{
    nb::list out;
    for (int i = 0; i < count; i++)
        out.append(load<double>(at + static_cast<size_t>(i) * sizeof(double)));
    return out;
}

nb::list rows(const lw_key &key, const unsigned char *at, const unsigned char *root)
{
    nb::list out;
    const auto where = load<lw_rows>(at);
    const unsigned char *row = root + key.pool->offset + static_cast<size_t>(where.first) * sizeof(double);
    for (int i = 0; i < where.count; i++, row += static_cast<size_t>(key.width) * sizeof(double))
        if (key.width == 1)
            out.append(load<double>(row));
        else
            out.append(numbers(row, key.width));
    return out;
}

nb::list items(const lw_key &key, const unsigned char *parent, const unsigned char *root)
{
    nb::list out;
    const int count = load<int>(parent + key.count_offset);
    for (int i = 0; i < count; i++)
        out.append(section(key.keys, parent + key.offset + static_cast<size_t>(i) * key.stride, root));
    return out;
}

nb::object value(const lw_key &key, const unsigned char *parent, const unsigned char *root)
{
    const unsigned char *at = parent + key.offset;
    switch (key.kind) {
    case LW_NUMBER: return nb::float_(load<double>(at));
    case LW_INTEGER: return nb::int_(load<int>(at));
    case LW_CHOICE: return nb::str(key.names[load<int>(at)]);
    case LW_VECTOR:
    case LW_LIMITS: return numbers(at, key.count);
    case LW_ROWS: return rows(key, at, root);
    case LW_SECTION: return section(key.keys, at, root);
    case LW_LIST: return items(key, parent, root);
    }
    return nb::none();
}

nb::dict section(const lw_key *keys, const unsigned char *at, const unsigned char *root)
{
    nb::dict out;
    for (; keys->name != nullptr; keys++)
        if (lw_schema_applies(keys, at))
            out[keys->name] = value(*keys, at, root);
    return out;
}

// What a function prints.
template <typename Print> std::string printed(Print print)
{
    char *text = nullptr;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (to == nullptr)
        throw std::bad_alloc();
    print(to);
    std::fclose(to);
    std::string out(text, size);
    std::free(text);
    return out;
}

} // namespace

Scene Scene::read(const std::string &text, const std::string &name, const std::vector<std::string> &sets)
{
    std::vector<const char *> set;
    for (const std::string &one : sets)
        set.push_back(one.c_str());
    const lw_source source = {name.c_str(), text.c_str(), set.data(), static_cast<int>(set.size())};
    Scene scene = {};
    lw_error error;
    if (lw_scene_read(&source, &scene.data, &error) != LW_OK)
        throw std::invalid_argument(error.text);
    return scene;
}

nb::dict Scene::to_dict() const
{
    const auto *root = reinterpret_cast<const unsigned char *>(&data);
    return section(lw_scene_keys(), root, root);
}

std::string Scene::to_yaml() const
{
    return printed([this](FILE *to) { lw_scene_write(&data, to); });
}

std::string describe_scene()
{
    return printed(lw_scene_describe);
}
