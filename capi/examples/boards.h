/* The engine's opaque scene: boards that face the camera, and how they come into the picture. */
#ifndef BOARDS_H
#define BOARDS_H

#include <math.h>
#include <string.h>
#include <vulkan/vulkan.h>

enum { WIDTH = 640, HEIGHT = 480, BOARDS = 9 * 6 + 1 };

typedef struct {
    float center[3], half[2], color[4];
} Board;

static float length(const float v[3]) { return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void normalize(float v[3]) {
    const float scale = 1.0f / length(v);
    for (int i = 0; i < 3; i++) {
        v[i] *= scale;
    }
}

/* A chequered wall behind the liquid as seen from the eye, and a post through its middle; far boards first. */
static void wall_and_post(Board boards[BOARDS], const float eye[3]) {
    const float light[4] = {0.7f, 0.65f, 0.55f, 1.0f}, dark[4] = {0.12f, 0.13f, 0.16f, 1.0f};
    float back[3] = {eye[0], eye[1], eye[2]};
    normalize(back);
    for (int i = 0; i < 3; i++) {
        back[i] = -back[i];
    }
    /* back x up */
    float right[3] = {-back[2], 0.0f, back[0]};
    normalize(right);
    Board *b = boards;
    for (int i = -4; i <= 4; i++) {
        for (int j = -4; j <= 1; j++, b++) {
            for (int k = 0; k < 3; k++) {
                const float up = k == 1 ? 1.0f : 0.0f;
                b->center[k] = 1.2f * back[k] + 0.3f * ((float)i * right[k] + (float)j * up);
            }
            b->half[0] = b->half[1] = 0.15f;
            memcpy(b->color, (i + j) % 2 == 0 ? light : dark, sizeof light);
        }
    }
    const Board post = {{0.0f, 0.0f, 0.0f}, {0.05f, 0.75f}, {0.8f, 0.08f, 0.05f, 1.0f}};
    *b = post;
}

/* A point by a matrix, column by column, with its fourth coordinate. */
static void transform(const float m[16], const float p[3], float to[4]) {
    for (int k = 0; k < 4; k++) {
        to[k] = m[12 + k] + (m[8 + k] * p[2] + (m[4 + k] * p[1] + m[k] * p[0]));
    }
}

static float pixel(float ndc, int size) { return fminf(fmaxf(roundf(0.5f * (ndc + 1.0f) * (float)size), 0.0f), (float)size); }

/* The pixels that a board covers, and its depth in the depth buffer; 0 if it is out of view. */
static int project(const Board *board, const float view[16], const float projection[16], float near_distance, VkRect2D *rect,
                   float *z) {
    float eye[4], clip[4], low[2], high[2];
    transform(view, board->center, eye);
    if (-eye[2] <= near_distance) {
        return 0;
    }
    const int size[2] = {WIDTH, HEIGHT};
    for (int corner = 0; corner < 2; corner++) {
        const float sign = corner ? 1.0f : -1.0f;
        const float at[3] = {eye[0] + sign * board->half[0], eye[1] + sign * board->half[1], eye[2]};
        transform(projection, at, clip);
        for (int k = 0; k < 2; k++) {
            const float x = pixel(clip[k] / clip[3], size[k]);
            low[k] = corner ? fminf(low[k], x) : x;
            high[k] = corner ? fmaxf(high[k], x) : x;
        }
    }
    transform(projection, eye, clip);
    *z = clip[2] / clip[3];
    rect->offset.x = (int32_t)low[0];
    rect->offset.y = (int32_t)low[1];
    rect->extent.width = (uint32_t)(high[0] - low[0]);
    rect->extent.height = (uint32_t)(high[1] - low[1]);
    return rect->extent.width > 0 && rect->extent.height > 0;
}

#endif
