/* What these programs have in common: checks, which are counted, liquid, and commands. */
#include <meniscus.h>

enum { WIDTH = 96, HEIGHT = 64, PARTICLES = 9 * 9 * 9 };
#include "../../examples/headless.h"

static int checks, failed;

/* The call's status, and a part of its message; "" where it went well. */
static void expect(int line, MeniscusStatus status, MeniscusStatus wanted, const char *said) {
    char text[2048] = "";
    if (status != MENISCUS_STATUS_OK) {
        meniscus_last_message(text, sizeof text);
    }
    checks++;
    if (status != wanted || !strstr(text, said)) {
        failed++;
        printf("line %d: %s, \"%s\"; wanted %s, \"%s\"\n", line, meniscus_status_name(status), text, meniscus_status_name(wanted),
               said);
    }
}

static void is_true(int line, int value, const char *what) {
    checks++;
    if (!value) {
        failed++;
        printf("line %d: not %s\n", line, what);
    }
}

#define OK(call) expect(__LINE__, call, MENISCUS_STATUS_OK, "")
#define ARGUMENT(call, said) expect(__LINE__, call, MENISCUS_STATUS_ERROR_ARGUMENT, said)
#define PARAMETER(call, said) expect(__LINE__, call, MENISCUS_STATUS_ERROR_PARAMETER, said)
#define ORDER(call, said) expect(__LINE__, call, MENISCUS_STATUS_ERROR_ORDER, said)
#define UNSUPPORTED(call, said) expect(__LINE__, call, MENISCUS_STATUS_ERROR_UNSUPPORTED, said)
#define MEMORY(call, said) expect(__LINE__, call, MENISCUS_STATUS_ERROR_MEMORY, said)
#define NOT_READY(call, said) expect(__LINE__, call, MENISCUS_STATUS_NOT_READY, said)
#define TRUE(value) is_true(__LINE__, value, #value)

/* Nine particles each way, two radii apart. */
static void lattice(float (*at)[3], float radius) {
    for (int i = 0; i < PARTICLES; i++) {
        const int whole[3] = {i % 9 - 4, i / 9 % 9 - 4, i / 81 - 4};
        for (int k = 0; k < 3; k++) {
            at[i][k] = 2.0f * radius * (float)whole[k];
        }
    }
}

/* Commands: begun when nothing runs any more, and waited for. */
static void begin(const Vulkan *vk, VkCommandBuffer cmd) {
    const VkCommandBufferBeginInfo info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    VK(vkDeviceWaitIdle(vk->device));
    VK(vkBeginCommandBuffer(cmd, &info));
}

static void submit(const Vulkan *vk, VkCommandBuffer cmd) {
    VK(vkEndCommandBuffer(cmd));
    const VkSubmitInfo info = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1, .pCommandBuffers = &cmd};
    VK(vkQueueSubmit(vk->queue, 1, &info, VK_NULL_HANDLE));
    VK(vkDeviceWaitIdle(vk->device));
}
