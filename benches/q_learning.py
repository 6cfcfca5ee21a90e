"""Q-learning of Gymnasium's mountain car with a table in plain Python: the rival of
benches/q_learning.rs, which runs this. Prints steps and the processor time they took, s."""

import random
import time

import gymnasium

STEPS = 300_000
CELLS = 100
EPSILON, GAMMA = 0.1, 0.99

env = gymnasium.make("MountainCar-v0", max_episode_steps=500)
table = [[0.0, 0.0, 0.0] for _ in range(CELLS * CELLS)]


def cell(observation):
    x, v = float(observation[0]), float(observation[1])
    ix = min(max(int((x + 1.2) / 1.7 * CELLS), 0), CELLS - 1)
    iv = min(max(int((v + 0.07) / 0.14 * CELLS), 0), CELLS - 1)
    return ix * CELLS + iv


random.seed(1)
steps = episode = 0
start = time.process_time()
while steps < STEPS:
    beta = min(1.0, 10.0 / (episode + 100) ** 0.51)
    observation, _ = env.reset(options={"low": -0.7, "high": -0.7})
    values = table[cell(observation)]
    done = False
    while not done:
        if random.random() < EPSILON:
            action = random.randrange(3)
        else:
            action = values.index(max(values))
        observation, reward, terminated, truncated, _ = env.step(action)
        following = table[cell(observation)]
        target = 100.0 if terminated else reward + GAMMA * max(following)
        values[action] += beta * (target - values[action])
        values = following
        steps += 1
        done = terminated or truncated
    episode += 1
print(steps, time.process_time() - start)
