/* The glue of the examples: pictures, meshes, command line, threads. */

#include "support.h"
#include "common.h"
#include "mesh.h"

/* tests run in the root of the project, the two twins at the same time */
#ifdef __cplusplus
#define OUT_FILE(name) "build/cpp_" name
#else
#define OUT_FILE(name) "build/c_" name
#endif

static void fill_image(image *picture, int width, int height, int channels)
{
    uint64_t seed = 7;
    size_t i, n = (size_t)width * (size_t)height * (size_t)channels;
    EXPECT(image_create(picture, width, height, channels));
    for (i = 0; i < n; ++i) picture->pixels[i] = (float)exp(8 * support_gaussian(&seed));
}

static int same_pixels(const image *a, const image *b)
{
    return a->width == b->width && a->height == b->height && a->channels == b->channels &&
           memcmp(a->pixels, b->pixels, (size_t)a->width * (size_t)a->height * (size_t)a->channels * sizeof(float)) ==
               0;
}

/* ---- pictures ---- */

TEST(pfm_comes_back)
{
    image a, b;
    fill_image(&a, 37, 11, 3);
    if (!EXPECT(image_save(&a, OUT_FILE("a.pfm"))) || !EXPECT(image_load(&b, OUT_FILE("a.pfm")))) return;
    EXPECT(same_pixels(&a, &b));
    image_free(&a);
    image_free(&b);
}

TEST(exr_comes_back)
{
    image a, b;
    size_t i;
    int worst = 0;
    fill_image(&a, 123, 45, 3);
    if (!image_save(&a, OUT_FILE("a.exr"))) {
        EXPECT(strstr(a.message, "libopenexr-dev") != NULL);
        image_free(&a);
        SKIP("needs libopenexr-dev");
    }
    if (!EXPECT(image_load(&b, OUT_FILE("a.exr")))) return;
    EXPECT(same_pixels(&a, &b));
    image_free(&b);
    for (i = 0; i < 123 * 45 * 3; ++i) a.pixels[i] = (float)(1.0 + (double)i / 7.0);
    EXPECT(image_save_exr(&a, OUT_FILE("half.exr"), 1));
    if (!EXPECT(image_load(&b, OUT_FILE("half.exr")))) return;
    for (i = 0; i < 123 * 45 * 3; ++i) worst |= !(fabsf(a.pixels[i] - b.pixels[i]) <= a.pixels[i] / 2048.0f);
    EXPECT(!worst);
    image_free(&a);
    image_free(&b);
}

TEST(one_channel_exr_is_grey)
{
    image a, b;
    int i, same = 1;
    fill_image(&a, 8, 4, 1);
    if (!image_save(&a, OUT_FILE("grey.exr"))) {
        EXPECT(a.message[0] != 0);
        image_free(&a);
        SKIP("needs libopenexr-dev");
    }
    if (!EXPECT(image_load(&b, OUT_FILE("grey.exr")))) return;
    EXPECT_EQ(b.channels, 3);
    for (i = 0; i < 96; ++i) same &= b.pixels[i] == a.pixels[i / 3];
    EXPECT(same);
    image_free(&a);
    image_free(&b);
}

TEST(png_keeps_8_bits)
{
    image a, b;
    int i, worst = 0;
    EXPECT(image_create(&a, 256, 3, 3));
    for (i = 0; i < 256 * 3 * 3; ++i) a.pixels[i] = (float)i / (256 * 9);
    a.pixels[0] = -1;
    a.pixels[1] = 2;
    a.pixels[2] = (float)NAN;
    if (!EXPECT(image_save(&a, OUT_FILE("a.png")))) return;
    if (!image_load(&b, OUT_FILE("a.png"))) {
        EXPECT(strstr(b.message, "libstb-dev") != NULL);
        image_free(&a);
        SKIP("reading .png needs libstb-dev");
    }
    EXPECT_EQ(b.width, 256);
    EXPECT_EQ(b.height, 3);
    EXPECT_NEAR(b.pixels[0], 0, 0);
    EXPECT_NEAR(b.pixels[1], 1, 0);
    EXPECT_NEAR(b.pixels[2], 0, 0);
    for (i = 3; i < 256 * 9; ++i) worst |= !(fabsf(a.pixels[i] - b.pixels[i]) <= 0.005f);
    EXPECT(!worst);
    image_free(&a);
    image_free(&b);
}

static int write_bytes(const char *path, const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    size_t written = file ? fwrite(bytes, 1, size, file) : 0;
    return file && fclose(file) == 0 && written == size;
}

TEST(hdr_comes_back)
{
    image a, b;
    size_t i;
    int worst = 0;
    fill_image(&a, 37, 11, 3);
    a.pixels[0] = (float)NAN, a.pixels[1] = -1, a.pixels[2] = 255.9f;
    if (!EXPECT(image_save(&a, OUT_FILE("a.hdr"))) || !EXPECT(image_load(&b, OUT_FILE("a.hdr")))) return;
    EXPECT(b.width == 37 && b.height == 11 && b.pixels[0] == 0 && b.pixels[1] == 0 && b.pixels[2] == 256);
    for (i = 1; i < 37 * 11; ++i) {
        float *u = a.pixels + 3 * i, *v = b.pixels + 3 * i, most = fmaxf(u[0], fmaxf(u[1], u[2]));
        worst |=
            !(fabsf(u[0] - v[0]) <= most / 256 && fabsf(u[1] - v[1]) <= most / 256 && fabsf(u[2] - v[2]) <= most / 256);
    }
    EXPECT(!worst);
    image_free(&a);
    image_free(&b);
}

/* Every format, cut anywhere behind its first bytes, is refused with a sentence and never shown in part. */
TEST(half_a_file_is_refused)
{
    static const char *const paths[] = {OUT_FILE("cut.hdr"), OUT_FILE("cut.pfm"), OUT_FILE("cut.png"),
                                        OUT_FILE("cut.exr"), OUT_FILE("cut.jpg")};
    image a;
    size_t i, size, part;
    const char *rle = support_data("hdr/memorial.hdr"), *photo = support_data("photos/brushes.jpg");
    for (i = 0; i < 5; ++i) {
        unsigned char *bytes;
        char why[FILE_MESSAGE];
        fill_image(&a, 40, 30, 3);
        if (i < 4 && !image_save(&a, paths[i])) {
            EXPECT(strstr(a.message, "libopenexr-dev") != NULL);
            image_free(&a);
            continue;
        }
        image_free(&a);
        if ((i == 4 && !photo) || !(bytes = file_read(i == 4 ? photo : i == 0 && rle ? rle : paths[i], &size, why)))
            continue;
        for (part = size / 5; part < size - 1; part += size / 5) {
            EXPECT(write_bytes(paths[i], bytes, part));
            if (!EXPECT(!image_load(&a, paths[i]) && a.message[0] && !a.pixels)) {
                printf("%s of %d bytes\n", paths[i], (int)part);
                image_free(&a);
            }
        }
        free(bytes);
    }
}

TEST(png_of_16_bits_keeps_them)
{
    static const unsigned char png[] = {
        137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 0, 2, 0, 0, 0, 1, 16, 2, 0, 0, 0, 43, 208,
        52, 158, 0, 0, 0, 24, 73, 68, 65, 84, 120, 1, 1, 13, 0, 242, 255, 0, 1, 1, 1, 2, 1, 44, 255, 255, 0, 0, 128, 0,
        13, 113, 2, 177, 45, 20, 135, 119, 0, 0, 0, 0, 73, 69, 78, 68, 174, 66, 96, 130};
    static const float words[6] = {257, 258, 300, 65535, 0, 32768};
    image a;
    int i;
    EXPECT(write_bytes(OUT_FILE("words.png"), png, sizeof png));
    if (!image_load(&a, OUT_FILE("words.png"))) {
        EXPECT(strstr(a.message, "libstb-dev") != NULL);
        SKIP("reading .png needs libstb-dev");
    }
    for (i = 0; i < 6; ++i) EXPECT_NEAR(a.pixels[i], sat__srgb_decode(words[i] / 65535), 0);
    image_free(&a);
}

#ifdef HAVE_STB
typedef struct jpeg { unsigned char bytes[8192]; size_t size; } jpeg;

static void jpeg_add(void *to, void *bytes, int size)
{
    jpeg *j = (jpeg *)to;
    if (j->size + (size_t)size > sizeof j->bytes) return;
    memcpy(j->bytes + j->size, bytes, (size_t)size);
    j->size += (size_t)size;
}

/* A picture 32 x 16 with one red quarter, and a note on how the camera was held: where red is when it is shown
   upright. */
TEST(jpeg_is_turned_as_the_camera_was_held)
{
    /* by the picture of EXIF 2.3, 4.6.4: the stored top left is shown top left, top right, bottom right, bottom left,
       and so on */
    static const unsigned char right[9] = {0, 0, 1, 1, 0, 0, 1, 1, 0}, below[9] = {0, 0, 0, 1, 1, 0, 0, 1, 1};
    static unsigned char pixels[32 * 16 * 3];
    static jpeg plain, noted;
    int turn, little, x, y;
    for (y = 0; y < 8; ++y)
        for (x = 0; x < 16; ++x) pixels[3 * (32 * y + x)] = 255;
    plain.size = 0;
    if (!EXPECT(stbi_write_jpg_to_func(jpeg_add, &plain, 32, 16, 3, pixels, 95))) return;
    for (little = 0; little < 2; ++little)
        for (turn = 1; turn <= 8; ++turn) {
            unsigned char exif[] = {0xff, 0xd8, 0xff, 0xe1, 0, 34, 'E', 'x', 'i', 'f', 0,    0, 'M',
                                    'M',  0,    42,   0,    0, 0,  8,   0,   1,   1,   0x12, 0, 3,
                                    0,    0,    0,    1,    0, 0,  0,   0,   0,   0,   0,    0};
            unsigned char other[] = {'I', 'I', 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 1, 3, 0, 1, 0, 0, 0, 0, 0};
            image a;
            int wide, u, v;
            if (little) memcpy(exif + 12, other, sizeof other);
            exif[little ? 30 : 31] = (unsigned char)turn;
            exif[5] = 34;
            noted.size = 0;
            jpeg_add(&noted, exif, 38);
            jpeg_add(&noted, plain.bytes + 2, (int)plain.size - 2);
            EXPECT(write_bytes(OUT_FILE("turned.jpg"), noted.bytes, noted.size));
            if (!EXPECT(image_load(&a, OUT_FILE("turned.jpg")))) { puts(a.message); continue; }
            wide = turn < 5;
            EXPECT(a.width == (wide ? 32 : 16) && a.height == (wide ? 16 : 32));
            u = right[turn] ? a.width - 3 : 2, v = below[turn] ? a.height - 3 : 2;
            EXPECT(a.pixels[3 * (v * a.width + u)] > 0.8f);
            u = right[turn] ? 2 : a.width - 3, v = below[turn] ? 2 : a.height - 3;
            EXPECT(a.pixels[3 * (v * a.width + u)] < 0.1f);
            image_free(&a);
        }
}
#endif

#ifdef HAVE_OPENEXR
/* An uncompressed picture of 2 x 1 pixels whose channel i holds i + 1 and i + 1.5. `layers`: names in the order of the
   alphabet. */
static int write_layers(const char *path, const char *const *names, int count)
{
    static jpeg file;
    unsigned char head[] = {0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0}, box[16] = {0}, four[4] = {0};
    int i, k;
    size_t list = 1;
#define ADD(text, size) jpeg_add(&file, (void *)(uintptr_t)(text), (int)(size))
#define ADD_INT(value) (four[0] = (unsigned char)(value), four[1] = (unsigned char)((value) >> 8), four[2] = four[3] = 0, ADD(four, 4))
    file.size = 0;
    ADD(head, 8);
    for (i = 0; i < count; ++i) list += strlen(names[i]) + 17;
    ADD("channels\0chlist", 16), ADD_INT(list);
    for (i = 0; i < count; ++i) ADD(names[i], strlen(names[i]) + 1), ADD_INT(2), ADD_INT(0), ADD_INT(1), ADD_INT(1);
    ADD("", 1);
    ADD("compression\0compression", 24), ADD_INT(1), ADD("", 1);
    box[8] = 1;
    ADD("dataWindow\0box2i", 17), ADD_INT(16), ADD(box, 16);
    ADD("displayWindow\0box2i", 20), ADD_INT(16), ADD(box, 16);
    ADD("lineOrder\0lineOrder", 20), ADD_INT(1), ADD("", 1);
    ADD("pixelAspectRatio\0float", 23), ADD_INT(4), ADD("\0\0\x80\x3f", 4);
    ADD("screenWindowCenter\0v2f", 23), ADD_INT(8), ADD(box + 9, 4), ADD(box + 9, 4);
    ADD("screenWindowWidth\0float", 24), ADD_INT(4), ADD("\0\0\x80\x3f", 4);
    ADD("", 1);
    ADD_INT(file.size + 8), ADD(box + 9, 4);
    ADD_INT(0), ADD_INT(8 * count);
    for (i = 0; i < count; ++i)
        for (k = 0; k < 2; ++k) {
            float v = (float)(i + 1) + 0.5f * (float)k;
            ADD(&v, 4);
        }
    return write_bytes(path, file.bytes, file.size);
}

TEST(exr_with_layers_shows_its_picture)
{
    static const char *const blender[] = {"ViewLayer.Combined.A", "ViewLayer.Combined.B", "ViewLayer.Combined.G",
                                          "ViewLayer.Combined.R", "ViewLayer.Depth.Z"};
    static const char *const passes[] = {"Diffuse.B", "Diffuse.G", "Diffuse.R", "beauty.B", "beauty.G", "beauty.R"};
    static const char *const grey[] = {"A", "Y"}, *const depth[] = {"Z"}, *const odd[] = {"A", "U", "V"},
                             *const plain[] = {"B", "G", "R", "a.B", "a.G", "a.R"};
    const struct { const char *const *names; int count; float r, g, b;
    } cases[] = {{blender, 5, 4, 3, 2}, {passes, 6, 6, 5, 4}, {grey, 2, 2, 2, 2},
                 {depth, 1, 1, 1, 1},   {plain, 6, 3, 2, 1},  {odd, 3, 0, 0, 0}};
    size_t i;
    image a;
    for (i = 0; i < 6; ++i) {
        EXPECT(write_layers(OUT_FILE("layers.exr"), cases[i].names, cases[i].count));
        if (i == 5) {
            EXPECT(!image_load(&a, OUT_FILE("layers.exr")) && strstr(a.message, "but A U V"));
            continue;
        }
        if (!EXPECT(image_load(&a, OUT_FILE("layers.exr")))) { puts(a.message); continue; }
        EXPECT(a.pixels[0] == cases[i].r && a.pixels[1] == cases[i].g && a.pixels[2] == cases[i].b &&
               a.pixels[3] == cases[i].r + 0.5f);
        image_free(&a);
    }
}
#endif

TEST(bad_files_are_refused_with_a_sentence)
{
    image a;
    FILE *file = fopen(OUT_FILE("bad.pfm"), "wb");
    if (!EXPECT(file != NULL)) return;
    fputs("PF\n10 10\n-1\n", file);
    fclose(file);
    EXPECT(!image_load(&a, OUT_FILE("bad.pfm")) && strstr(a.message, "ends too early") && !a.pixels);
    EXPECT(!image_load(&a, "no/such.exr") && strstr(a.message, "cannot be opened"));
    EXPECT(!image_load(&a, "Makefile") && strstr(a.message, "is none of"));
    EXPECT(!image_create(&a, 0, 5, 3));
    EXPECT(!image_create(&a, 1 << 20, 5, 3));
    file = fopen(OUT_FILE("bad.exr"), "wb");
    if (!EXPECT(file != NULL)) return;
    fputs("this is no picture", file);
    fclose(file);
    EXPECT(!image_load(&a, OUT_FILE("bad.exr")) && a.message[0] && !a.pixels);
}

/* Every input the project is tried on: its size, or why it is refused. */
typedef struct known_file { const char *path; int width, height; const char *refused; } known_file;

static const known_file known_files[] = {
    {"hdr/Desk.exr", 644, 874, NULL},
    {"hdr/StillLife.exr", 1240, 846, NULL},
    {"hdr/memorial.exr", 512, 768, NULL},
    {"hdr/memorial.hdr", 512, 768, NULL},
    {"hdr/belgium.exr", 1025, 769, NULL},
    {"hdr/belgium.hdr", 1025, 769, NULL},
    {"hdr/GoldenGate.exr", 1262, 860, NULL},
    {"hdr/Fog.exr", 1000, 672, NULL},
    {"hdr/Carrots.exr", 600, 400, NULL},
    {"hdr/MtTamNorth.exr", 1198, 796, NULL},
    {"hdr/AllHalfValues.exr", 256, 256, NULL},
    {"hdr/BrightRingsNanInf.exr", 800, 800, NULL},
    {"hdr/WideFloatRange.exr", 500, 500, NULL},
    {"hdr/WideColorGamut.exr", 800, 800, NULL},
    {"env/city.exr", 1024, 512, NULL},
    {"env/interior.exr", 1024, 512, NULL},
    {"env/night.exr", 1024, 512, NULL},
    {"env/forest.exr", 1024, 512, NULL},
    {"env/studio.exr", 1024, 512, NULL},
    {"env/esplanade.exr", 512, 256, NULL},
    {"env/workshop.exr", 512, 256, NULL},
    {"env/lobby.exr", 512, 256, NULL},
    {"env/apartment.exr", 512, 256, NULL},
    {"env/StageEnvLatLong.exr", 1000, 500, NULL},
    {"env/city_original_dwab.exr", 0, 0, "DWAB"},
    {"photos/brushes.jpg", 1024, 806, NULL},
    {"tiles/tiles_0.png", 2048, 2048, NULL},
};

TEST(known_files_load_or_are_refused)
{
    size_t i;
    int seen = 0, absent_package = 0;
    for (i = 0; i < sizeof known_files / sizeof known_files[0]; ++i) {
        const known_file *k = &known_files[i];
        const char *path = support_data(k->path);
        image a;
        if (!path) continue;
        ++seen;
        if (!image_load(&a, path)) {
            if (strstr(a.message, "apt-get")) { absent_package = 1; continue; }
            if (!EXPECT(k->refused && strstr(a.message, k->refused))) puts(a.message);
            continue;
        }
        EXPECT(!k->refused);
        EXPECT_EQ(a.width, k->width);
        EXPECT_EQ(a.height, k->height);
        image_free(&a);
    }
    if (absent_package) SKIP("reading all inputs needs libopenexr-dev and libstb-dev");
    if (!seen) SKIP("no inputs in $LIGHTSCAN_DATA, ../shared/data or data");
}

static double mean_of(const image *a, int channel, int x0, int x1)
{
    double sum = 0;
    int x, y;
    for (y = 0; y < a->height; ++y)
        for (x = x0; x < x1; ++x)
            sum += (double)a->pixels[3 * ((size_t)y * (size_t)a->width + (size_t)x) + (size_t)channel];
    return sum / a->height / (x1 - x0);
}

TEST(same_picture_in_both_formats)
{
    const char *exr = support_data("hdr/memorial.exr"), *hdr = support_data("hdr/memorial.hdr");
    image a, b;
    if (!exr || !hdr) SKIP("hdr/memorial.exr and .hdr are not there");
    if (!image_load(&a, exr)) SKIP(a.message);
    if (!image_load(&b, hdr)) { image_free(&a); SKIP(b.message); }
    EXPECT(same_pixels(&a, &b));
    image_free(&a);
    image_free(&b);
}

/* The right half of a chroma-subsampled picture is not empty, and its colours are those of a landscape. */
TEST(subsampled_chroma_is_whole)
{
    const char *path = support_data("hdr/MtTamNorth.exr");
    image a;
    if (!path) SKIP("hdr/MtTamNorth.exr is not there");
    if (!image_load(&a, path)) SKIP(a.message);
    EXPECT(mean_of(&a, 1, a.width / 2, a.width) > 0.1 * mean_of(&a, 1, 0, a.width / 2));
    EXPECT(mean_of(&a, 0, 0, a.width) > 0.3 * mean_of(&a, 1, 0, a.width));
    EXPECT(mean_of(&a, 0, 0, a.width) < 3.0 * mean_of(&a, 1, 0, a.width));
    image_free(&a);
}

/* ---- meshes ---- */

TEST(known_meshes_load)
{
    static const struct { const char *path; int vertices, triangles; } known[] = {
        {"mesh/bunny.ply", 35947, 69451}, {"mesh/bunny_small.ply", 1839, 3674}, {"mesh/dragon_res4.ply", 5205, 11102},
        {"mesh/dragon_res4_ascii.ply", 5205, 11102}, {"mesh/queen.ply", 5162, 10320}, {"mesh/fandisk.ply", 6475, 12946},
        {"mesh/teapot.ply", 3644, 6320}, {"mesh/city_gen1.ply", 19721, 27562}};
    size_t i;
    int seen = 0;
    for (i = 0; i < sizeof known / sizeof known[0]; ++i) {
        const char *path = support_data(known[i].path);
        float low[3], high[3];
        mesh m;
        if (!path) continue;
        ++seen;
        if (!EXPECT(mesh_load(&m, path))) { puts(m.message); continue; }
        EXPECT_EQ(m.vertex_count, known[i].vertices);
        EXPECT_EQ(m.triangle_count, known[i].triangles);
        mesh_bounds(&m, low, high);
        EXPECT(low[0] < high[0] && low[1] < high[1] && low[2] < high[2] && high[0] < 1e6f);
        mesh_free(&m);
    }
    if (!seen) SKIP("no meshes in $LIGHTSCAN_DATA, ../shared/data or data");
}

static int write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    if (!file) return 0;
    fputs(text, file);
    return fclose(file) == 0;
}

TEST(obj_with_a_quad_and_negative_numbers)
{
    mesh m;
    if (!EXPECT(write_text(OUT_FILE("quad.obj"), "# four\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2 3//3 4\nf -4 -3 -2\n"))) return;
    if (!EXPECT(mesh_load(&m, OUT_FILE("quad.obj")))) return;
    EXPECT_EQ(m.triangle_count, 3);
    EXPECT_EQ(m.indices[5], 3);
    EXPECT_EQ(m.indices[6], 0);
    mesh_free(&m);
}

TEST(bad_meshes_are_refused)
{
    mesh m;
    EXPECT(write_text(OUT_FILE("bad.obj"), "v 0 0 0\nf 1 2 3\n") && !mesh_load(&m, OUT_FILE("bad.obj")) &&
           strstr(m.message, "does not exist"));
    EXPECT(write_text(OUT_FILE("bad.ply"), "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nend_header\n1 2") &&
           !mesh_load(&m, OUT_FILE("bad.ply")) && strstr(m.message, "too early"));
    EXPECT(!mesh_load(&m, "no/such.ply") && strstr(m.message, "cannot be opened"));
    EXPECT(m.positions == NULL && m.indices == NULL);
}

/* ---- command line, threads, text ---- */

TEST(options_are_read)
{
    float key = 1;
    double white = 2;
    int local = 0, frames = 2, size[2] = {0, 0}, hour = 1, i;
    const char *in = NULL, *shape = NULL;
    common_settings common;
    common_option options[8] = {{"key", 'f', &key, 0, 1, ""},
                                {"local", 'b', &local, 0, 0, ""},
                                {"frames", 'i', &frames, 1, 9, ""},
                                {"size", 'z', size, 1, 4096, ""},
                                {"hour", 'w', &hour, 0, 0, "dusk|night|noon of the day"},
                                {"in", 'P', (void *)&in, 0, 0, ""},
                                {"mesh", 'M', (void *)&shape, 0, 0, ""},
                                {"white", 'd', &white, 0, INFINITY, ""}};
    char words[13][24] = {"prog", "--key",     "0.5", "in.exr", "--local",         "--size=1280x720", "--hour",
                          "noon", "--threads", "2",   "-o",     OUT_FILE("o.png"), "bunny.ply"};
    char *argv[14], text[128];
    for (i = 0; i < 13; ++i) argv[i] = words[i];
    argv[13] = NULL;
    common_parse(&common, 13, argv, "prog", ".png", options, 8);
    EXPECT_NEAR(key, 0.5, 0);
    EXPECT(local && size[0] == 1280 && size[1] == 720 && hour == 2);
    EXPECT_EQ(frames, 2);
    EXPECT(strcmp(common.out, OUT_FILE("o.png")) == 0);
    EXPECT(common.workers == 2 || !common.threads.parallel_for);
    EXPECT(in && strcmp(in, "in.exr") == 0 && shape && strcmp(shape, "bunny.ply") == 0);
    EXPECT(!common_set(&options[0], "fast") && !common_set(&options[0], "1.1") && !common_set(&options[0], "nan") &&
           !common_set(&options[2], "1.5"));
    EXPECT(!common_set(&options[2], "0") && !common_set(&options[2], "10") &&
           !common_set(&options[2], "99999999999999999999"));
    EXPECT(!common_set(&options[3], "10") && !common_set(&options[3], "0x0") && !common_set(&options[3], "10x5000") &&
           !common_set(&options[3], "1x1x"));
    EXPECT(!common_set(&options[4], "du") && !common_set(&options[4], "") && !common_set(&options[4], "of") &&
           common_set(&options[4], "dusk") && hour == 0);
    EXPECT(common_set(&options[7], "inf") && white > 1e300);
    options[0].type = 'm';
    EXPECT(common_set(&options[0], "0.25mm") && !common_set(&options[0], "0.25cm"));
    EXPECT_NEAR(key, 0.25, 0);
    common_range(text, sizeof text, &options[2]);
    EXPECT(strcmp(text, "must be 1 to 9") == 0);
    common_range(text, sizeof text, &options[4]);
    EXPECT(strcmp(text, "must be dusk, night or noon") == 0);
    common_close(&common);
}

/* ---- files ---- */

static int holds(const char *path, const char *text)
{
    char bytes[64] = "", why[FILE_MESSAGE];
    size_t size;
    unsigned char *have = file_read(path, &size, why);
    if (have && size < sizeof bytes) memcpy(bytes, have, size);
    free(have);
    return strcmp(bytes, text) == 0;
}

TEST(a_file_is_written_whole_or_not_at_all)
{
    file_writer f;
    char why[FILE_MESSAGE] = "";
    if (!EXPECT(write_text(OUT_FILE("whole.txt"), "old"))) return;
    EXPECT(file_open(&f, OUT_FILE("whole.txt"), why));
    file_put(&f, "new", 3);
    fflush(f.file);
    EXPECT(holds(OUT_FILE("whole.txt"), "old"));
    EXPECT(file_close(&f, 1, why) && holds(OUT_FILE("whole.txt"), "new"));
    EXPECT(file_open(&f, OUT_FILE("whole.txt"), why));
    file_put(&f, "half", 4);
    f.error = ENOSPC;
    EXPECT(!file_close(&f, 1, why) && strstr(why, "No space") && holds(OUT_FILE("whole.txt"), "new"));
    EXPECT(access(f.part, F_OK) != 0);
    EXPECT(!file_open(&f, "no/such/folder.txt", why) && strstr(why, "no such folder") && !file_close(&f, 1, why));
    EXPECT(!file_open(&f, "build", why) && strstr(why, "is a folder"));
    EXPECT(!file_open(&f, "Makefile/x.txt", why) && strstr(why, "cannot be written"));
    EXPECT(!file_open(&f, "", why));
}

#ifndef _WIN32
TEST(links_are_followed_and_known)
{
    file_writer f;
    file_id a, b;
    char why[FILE_MESSAGE] = "";
    remove(OUT_FILE("soft.txt")), remove(OUT_FILE("loop.txt"));
    if (!EXPECT(write_text(OUT_FILE("target.txt"), "old")) ||
        symlink(strrchr(OUT_FILE("target.txt"), '/') + 1, OUT_FILE("soft.txt")))
        return;
    EXPECT(file_identify(&a, OUT_FILE("target.txt")) && file_identify(&b, OUT_FILE("soft.txt")) &&
           a.volume == b.volume && a.number == b.number);
    EXPECT(file_open(&f, OUT_FILE("soft.txt"), why));
    file_put(&f, "new", 3);
    EXPECT(file_close(&f, 1, why) && holds(OUT_FILE("target.txt"), "new") && holds(OUT_FILE("soft.txt"), "new"));
    EXPECT(symlink(strrchr(OUT_FILE("loop.txt"), '/') + 1, OUT_FILE("loop.txt")) == 0 &&
           !file_open(&f, OUT_FILE("loop.txt"), why));
}

TEST(a_full_disk_is_told)
{
    image a;
    static const char *const paths[] = {OUT_FILE("full.png"), OUT_FILE("full.pfm"), OUT_FILE("full.hdr"),
                                        OUT_FILE("full.exr")};
    size_t i;
    if (access("/dev/full", W_OK)) SKIP("there is no /dev/full");
    fill_image(&a, 64, 64, 3);
    for (i = 0; i < 4; ++i) {
        remove(paths[i]);
        if (!EXPECT(symlink("/dev/full", paths[i]) == 0)) continue;
        EXPECT(!image_save(&a, paths[i]) && (strstr(a.message, "No space") || strstr(a.message, "libopenexr-dev")));
        EXPECT(access(paths[i], F_OK) == 0);
    }
    image_free(&a);
}
#endif

/* The library's error handler must not ask the library anything. */
TEST(a_missing_folder_ends_every_writer)
{
    image a;
    fill_image(&a, 8, 8, 3);
    EXPECT(!image_save(&a, "no/such/a.exr") && a.message[0]);
    EXPECT(!image_save(&a, "no/such/a.png") && strstr(a.message, "no such folder"));
    EXPECT(!image_save(&a, "no/such/a.hdr") && strstr(a.message, "no such folder"));
    EXPECT(!image_save(&a, "no/such/a.pfm") && strstr(a.message, "no such folder"));
    EXPECT(!image_save(&a, OUT_FILE("a.tga")) && strstr(a.message, "is none of"));
    image_free(&a);
}

static void mark_range(int begin, int end, int worker, void *context)
{
    unsigned char *marks = (unsigned char *)context;
    int i;
    (void)worker;
    for (i = begin; i < end; ++i) ++marks[i];
}

TEST(threads_cover_each_item_once)
{
    static unsigned char marks[1000];
    int workers = 3, i, once = 1;
    sat_threads t = common_threads(&workers);
    if (!t.parallel_for) {
        EXPECT_EQ(workers, 1);
        SKIP("built without OpenMP");
    }
    t.parallel_for(1000, mark_range, marks, t.user);
    for (i = 0; i < 1000; ++i) once &= marks[i] == 1;
    EXPECT(once);
}

TEST(contact_sheet_is_written)
{
    static unsigned char grey[40 * 30 * 3];
    common_cell cells[3] = {{grey, 40, 30, "A: 1e-6"}, {grey, 40, 30, "b_c"}, {grey, 40, 30, NULL}};
    common_canvas canvas = {grey, 40, 30};
    common_settings common;
    int i, white = 0;
    memset(grey, 128, sizeof grey);
    common_text(&canvas, 1, 1, "I", 1);
    for (i = 0; i < 40 * 30; ++i) white += grey[3 * i] == 255;
    EXPECT_EQ(white, 11);       /* the serifs and the stem */
    memset(&common, 0, sizeof common);
    common.name = "prog";
    common.writes = ".png";
    EXPECT(common_contact_sheet(&common, OUT_FILE("sheet.png"), cells, 3, 2));
}
