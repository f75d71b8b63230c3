/* Bytes as options, images, meshes, receivers and saves: nothing may crash, hang, read out of bounds or give NaN. */
#define SAT_IMPLEMENTATION
#define FIV_IMPLEMENTATION
#include "fiv.h"
#include <stdlib.h>
#include <string.h>

typedef struct input { const uint8_t *bytes; size_t left; } input;

static unsigned take(input *in)
{
    if (!in->left) return 0;
    in->left--;
    return *in->bytes++;
}

/* Any float at all, now and then; else a tame one. */
static float take_float(input *in)
{
    unsigned kind = take(in);
    uint32_t bits = take(in);
    float v;
    if (kind > 16) return (float)(int)(bits - 128) / 32;
    bits |= take(in) << 8 | take(in) << 16 | take(in) << 24;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static void check(float v)
{
    if (!(v >= 0)) abort();
}

static void fuzz_load(input *in)
{
    fiv_occluder *o = NULL;
    uint8_t *copy = (uint8_t *)malloc(in->left + 1);
    memcpy(copy, in->bytes, in->left);
    if (in->left >= 16) { /* let some pass the hash */
        uint64_t magic = FIV__MAGIC, hash = fiv__hash(FIV__HASH, copy + 16, in->left - 16);
        memcpy(copy, &magic, 8);
        memcpy(copy + 8, &hash, 8);
    }
    fiv_occluder_load(&o, copy, in->left, NULL);
    fiv_occluder_destroy(o);
    free(copy);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input in;
    float pixels[6 * 3 * 3], positions[3 * 12], points[3 * 4], normals[3 * 4], rgb[3 * 4], turn[9];
    unsigned indices[3 * 14];
    sat_image image;
    fiv_environment_options eo = fiv_environment_defaults();
    fiv_occluder_options oo = fiv_occluder_defaults();
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_environment *e = NULL;
    fiv_occluder *o = NULL;
    fiv_instance instances[2];
    int i, rotated;
    in.bytes = data, in.left = size;
    if (take(&in) % 4 == 0) {
        fuzz_load(&in);
        return 0;
    }
    eo.resolution = (int)(take(&in) % 24), oo.resolution = take(&in) % 8 ? eo.resolution : (int)take(&in);
    eo.delta_ratio = take(&in) % 4 ? 20 : take_float(&in);
    eo.max_radiance = take(&in) % 4 ? 1e10f : take_float(&in);
    oo.theta = (int)(take(&in) % 12), oo.phi = (int)(take(&in) % 8), oo.rho = (int)(take(&in) % 5);
    if (take(&in) % 4 == 0) oo.first_shell = take_float(&in), oo.last_shell = take_float(&in);
    oo.storage = take(&in) % 2 ? FIV_STORAGE_FLOAT : FIV_STORAGE_HALF_OCTAHEDRAL;
    oo.keep_masks = (int)(take(&in) % 2), oo.lazy = (int)(take(&in) % 2);
    io.accuracy = (fiv_accuracy)(take(&in) % 4);
    io.partial = (int)(take(&in) % 2), io.overlap = (int)(take(&in) % 2), io.cutoff = take_float(&in);
    for (i = 0; i < 54; i++) pixels[i] = take_float(&in);
    for (i = 0; i < 36; i++) positions[i] = take_float(&in);
    for (i = 0; i < 42; i++) indices[i] = take(&in) % 12;
    for (i = 0; i < 12; i++) points[i] = take_float(&in), normals[i] = take_float(&in);
    rotated = (int)(take(&in) % 3);
    for (i = 0; i < 9; i++) turn[i] = rotated == 1 ? (i % 4 == 0) : take_float(&in);
    image = sat_image_f32(pixels, 6, 3, 3);
    if (fiv_environment_create(&e, &image, &eo, NULL) == SAT_OK) {
        fiv_environment_update(e, NULL, rotated ? turn : NULL);
        for (i = 0; i < 4; i++) {
            fiv_environment_irradiance(rgb, e, normals + 3 * i);
        }
        if (fiv_occluder_create(&o, positions, 12, indices, 14, &oo, NULL) == SAT_OK &&
            fiv_occluder_light(o, e, rotated ? turn : NULL) == SAT_OK) {
            for (i = 0; i < 2; i++) {
                instances[i].occluder = o;
                instances[i].position[0] = take_float(&in), instances[i].position[1] = take_float(&in),
                instances[i].position[2] = take_float(&in);
                instances[i].scale = take_float(&in);
            }
            fiv_occluder_prepare(o, NULL, instances, 2, points, 4);
            if (fiv_irradiance(rgb, points, normals, 4, e, instances, 2, &io, NULL) == SAT_OK)
                for (i = 0; i < 12; i++) check(rgb[i]);
            if (fiv_self_irradiance(rgb, points, normals, 4, e, instances, instances + 1, 1, &io, NULL) == SAT_OK)
                for (i = 0; i < 12; i++) check(rgb[i]);
            fiv_occluder_invalidate(o, positions);
        }
    }
    fiv_occluder_destroy(o);
    fiv_environment_destroy(e);
    return 0;
}
